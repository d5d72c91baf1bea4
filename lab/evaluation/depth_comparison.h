/// Depth images against a mesh: how well it predicts measurements that it was not made from.
#pragma once

#include <string>
#include <vector>

#include "evaluation/depth_renderer.h"
#include "evaluation/mesh_metrics.h"

namespace dtsdf {

/// Gathers the differences between measured depth and that of a mesh, pixel by pixel.
class DepthComparison {
 public:
  /// Takes every `stride`-th pixel of each row and column.
  explicit DepthComparison(int stride) : stride_(stride) {}

  /// Adds one image; both are row-major, in metres, 0 where there is nothing.
  void add(const std::vector<float>& measured_m, const std::vector<float>& predicted_m,
           const ViewCamera& camera);

  /// Takes over what another comparison has gathered.
  void merge(const DepthComparison& other);

  /// As a JSON object: shares of the measured pixels, and distances over those that the mesh
  /// covers, in millimetres. In front are skirts and floaters: a hole in the mesh shows what is
  /// behind it, or nothing.
  std::string toJson() const;

 private:
  int stride_;
  size_t images_ = 0, measured_ = 0;
  std::vector<double> behind_m_;       ///< Predicted - measured, of each covered pixel.
  std::vector<double> behind_shares_;  ///< In shares of the measured depth.
};

}  // namespace dtsdf
