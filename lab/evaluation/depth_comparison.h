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

  size_t images() const { return images_; }
  size_t measuredPixels() const { return measured_; }

  /// Share of the measured pixels at which the mesh has a surface.
  double coveredShare() const;

  /// |measured - predicted| in metres over the covered pixels.
  DistanceStats errors() const;

  /// Share of the measured pixels at which the mesh is within this share of the depth.
  double shareWithin(double depth_share) const;

  /// Shares of the measured pixels at which the mesh hangs in front of what was measured, or lies
  /// behind it, by more than a share of the measured depth or than a distance. In front are skirts
  /// and floaters: a hole in the mesh shows what is behind it, or nothing.
  double shareInFront(double depth_share) const;
  double shareBehind(double depth_share) const;
  double shareInFrontBy(double distance_m) const;
  double shareBehindBy(double distance_m) const;

  /// The figures as a JSON object; distances in millimetres, as the keys say.
  std::string toJson() const;

 private:
  template <class Predicate>
  double shareOfMeasured(const std::vector<double>& values, Predicate predicate) const;

  int stride_;
  size_t images_ = 0, measured_ = 0;
  std::vector<double> behind_m_;       ///< Predicted - measured, of each covered pixel.
  std::vector<double> behind_shares_;  ///< The same as shares of the measured depth.
};

}  // namespace dtsdf
