#include "evaluation/depth_comparison.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace dtsdf {

void DepthComparison::add(const std::vector<float>& measured_m,
                          const std::vector<float>& predicted_m, const ViewCamera& camera) {
  ++images_;
  for (int v = 0; v < camera.height; v += stride_) {
    for (int u = 0; u < camera.width; u += stride_) {
      const size_t pixel =
          static_cast<size_t>(v) * static_cast<size_t>(camera.width) + static_cast<size_t>(u);
      const double measured = static_cast<double>(measured_m[pixel]);
      const double predicted = static_cast<double>(predicted_m[pixel]);
      if (measured <= 0.0) continue;
      ++measured_;
      if (predicted <= 0.0) continue;
      errors_m_.push_back(std::abs(measured - predicted));
      depth_shares_.push_back(errors_m_.back() / measured);
    }
  }
}

void DepthComparison::merge(const DepthComparison& other) {
  images_ += other.images_;
  measured_ += other.measured_;
  errors_m_.insert(errors_m_.end(), other.errors_m_.begin(), other.errors_m_.end());
  depth_shares_.insert(depth_shares_.end(), other.depth_shares_.begin(),
                       other.depth_shares_.end());
}

double DepthComparison::coveredShare() const {
  if (measured_ == 0) return 0.0;
  return static_cast<double>(errors_m_.size()) / static_cast<double>(measured_);
}

double DepthComparison::shareWithin(double depth_share) const {
  if (measured_ == 0) return 0.0;
  const auto within = std::count_if(depth_shares_.begin(), depth_shares_.end(),
                                    [&](double share) { return share <= depth_share; });
  return static_cast<double>(within) / static_cast<double>(measured_);
}

std::string DepthComparison::toJson() const {
  const DistanceStats stats = errors();
  const nlohmann::json json = {{"images", images_},
                               {"measured_pixels", measured_},
                               {"covered_share", coveredShare()},
                               {"share_within_1_percent", shareWithin(0.01)},
                               {"share_within_2_percent", shareWithin(0.02)},
                               {"share_within_5_percent", shareWithin(0.05)},
                               {"rmse_mm", 1e3 * stats.rmse_m},
                               {"mean_mm", 1e3 * stats.mean_m},
                               {"median_mm", 1e3 * stats.median_m},
                               {"p95_mm", 1e3 * stats.p95_m},
                               {"max_mm", 1e3 * stats.max_m}};
  return json.dump(2) + "\n";
}

}  // namespace dtsdf
