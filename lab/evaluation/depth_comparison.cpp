#include "evaluation/depth_comparison.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace dtsdf {

void DepthComparison::add(const std::vector<float>& measured_m,
                          const std::vector<float>& predicted_m, const ViewCamera& camera) {
  ++images_;
  for (int v = 0; v < camera.height; v += stride_) {
    for (int u = 0; u < camera.width; u += stride_) {
      const size_t pixel = camera.pixelAt(u, v);
      const double measured = static_cast<double>(measured_m[pixel]);
      const double predicted = static_cast<double>(predicted_m[pixel]);
      if (measured <= 0.0) continue;
      ++measured_;
      if (predicted <= 0.0) continue;
      behind_m_.push_back(predicted - measured);
      behind_shares_.push_back(behind_m_.back() / measured);
    }
  }
}

void DepthComparison::merge(const DepthComparison& other) {
  images_ += other.images_;
  measured_ += other.measured_;
  behind_m_.insert(behind_m_.end(), other.behind_m_.begin(), other.behind_m_.end());
  behind_shares_.insert(behind_shares_.end(), other.behind_shares_.begin(),
                        other.behind_shares_.end());
}

std::string DepthComparison::toJson() const {
  const auto share = [&](size_t count) {
    return measured_ == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(measured_);
  };
  const auto shareWhere = [&](const auto& holds) {
    return share(
        static_cast<size_t>(std::count_if(behind_shares_.begin(), behind_shares_.end(), holds)));
  };
  const auto within = [&](double by) {
    return shareWhere([by](double value) { return std::abs(value) <= by; });
  };
  std::vector<double> errors_m = behind_m_;
  for (double& error_m : errors_m) error_m = std::abs(error_m);
  const DistanceStats stats = distanceStats(std::move(errors_m));
  const nlohmann::json json = {
      {"images", images_},
      {"measured_pixels", measured_},
      {"covered_share", share(behind_m_.size())},
      {"share_within_1_percent", within(0.01)},
      {"share_within_2_percent", within(0.02)},
      {"share_within_5_percent", within(0.05)},
      {"share_in_front_5_percent", shareWhere([](double value) { return value < -0.05; })},
      {"share_behind_5_percent", shareWhere([](double value) { return value > 0.05; })},
      {"rmse_mm", 1e3 * stats.rmse_m},
      {"mean_mm", 1e3 * stats.mean_m},
      {"median_mm", 1e3 * stats.median_m},
      {"p95_mm", 1e3 * stats.p95_m},
      {"max_mm", 1e3 * stats.max_m}};
  return json.dump(2) + "\n";
}

}  // namespace dtsdf
