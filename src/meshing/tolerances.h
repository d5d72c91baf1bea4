/// How far vertices may move before surfaces that face each other could meet.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "meshing/surface_distance.h"

namespace dtsdf {

/// For some vertices of a mesh, which outlives it, almost half of their distance from an opposing
/// surface. Wide gaps are measured only where a large error asks for them: most vertices never do.
class Tolerances {
 public:
  /// Errors are at most `max_error_m`; `report` is called now and then with the share that is done.
  Tolerances(const Mesh& mesh, const std::vector<uint32_t>& vertices, const FacingLimits& opposing,
             double mean_edge_m, double max_error_m,
             const std::function<void(double share)>& report);

  /// What one of the vertices may move within an error.
  double within(uint32_t vertex, double error_m) {
    const float tolerance_m = tolerance_m_[vertex];
    if (tolerance_m >= 0.0f)
      return error_m < tolerance_m ? error_m : static_cast<double>(tolerance_m);
    return error_m <= near_m_ ? error_m : measured(vertex, error_m);
  }

 private:
  float measure(uint32_t vertex, double error_m);
  double measured(uint32_t vertex, double error_m);

  const Mesh& mesh_;
  const FacingLimits opposing_;
  const double near_m_, max_error_m_;
  const SurfaceTree tree_;
  SurfaceTree::Hint hint_ = SurfaceTree::kNoHint;  ///< Neighbours have neighbouring numbers.
  std::vector<float> tolerance_m_;  ///< Negative: none found within what errors up to near_m_ need.
};

}  // namespace dtsdf
