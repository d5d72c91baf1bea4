/// Compares depth images with a mesh: how well the mesh predicts measurements that were not used to
/// make it.
#pragma once

#include <string>
#include <vector>

#include "evaluation/depth_renderer.h"
#include "evaluation/mesh_metrics.h"

namespace dtsdf {

/// Collects the differences between measured depth and the depth of a mesh, pixel by pixel.
class DepthComparison {
 public:
  /// Compares every `stride`-th pixel of every `stride`-th row.
  explicit DepthComparison(int stride) : stride_(stride) {}

  /// Adds a depth image, and the mesh's depth as seen from the same pose; both row-major, in
  /// metres, 0 for no depth.
  void add(const std::vector<float>& measured_m, const std::vector<float>& predicted_m,
           const ViewCamera& camera);

  /// Adds the data of another comparison.
  void merge(const DepthComparison& other);

  /// The figures as a JSON object: shares of the measured pixels, and distances over the measured
  /// pixels that the mesh covers, in millimetres. Skirts and floaters of the mesh show as depths in
  /// front of the measured depths. Through a hole in the mesh, a ray hits a surface farther away,
  /// or none.
  std::string toJson() const;

 private:
  int stride_;
  size_t images_ = 0, measured_ = 0;
  std::vector<double> behind_m_;       ///< Predicted - measured, of each covered pixel.
  std::vector<double> behind_shares_;  ///< behind_m_ divided by the measured depth.
};

}  // namespace dtsdf
