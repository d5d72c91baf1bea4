/// Compares depth images with a mesh, to find out how well the mesh predicts measurements that were
/// not used to build it.
#pragma once

#include <string>
#include <vector>

#include "evaluation/depth_renderer.h"
#include "evaluation/mesh_metrics.h"

namespace dtsdf {

/// Collects the differences between measured depths and the rendered depth of a mesh, pixel by
/// pixel.
class DepthComparison {
 public:
  /// Compares every `stride`-th pixel of every `stride`-th row.
  explicit DepthComparison(int stride) : stride_(stride) {}

  /// Adds a depth image and the depth of the mesh rendered from the same pose. Both are row-major,
  /// in metres; 0: no depth.
  void add(const std::vector<float>& measured_m, const std::vector<float>& predicted_m,
           const ViewCamera& camera);

  /// Adds the data of another comparison.
  void merge(const DepthComparison& other);

  /// The metrics as a JSON object: fractions of the measured pixels, and distances in millimetres
  /// over those measured pixels that the mesh covers. Skirts and floaters appear as rendered depths
  /// in front of the measured depths. Where the mesh has a hole, the rendered depth is behind the
  /// measured depth or missing.
  std::string toJson() const;

 private:
  int stride_;
  size_t images_ = 0, measured_ = 0;
  std::vector<double> behind_m_;       ///< Predicted minus measured depth, per covered pixel.
  std::vector<double> behind_shares_;  ///< behind_m_ divided by the measured depth.
};

}  // namespace dtsdf
