#include "level/still_gravity.h"

#include <cmath>

namespace dtsdf {
namespace {

constexpr size_t kMinSamples = 20;
/// Once there are kMinSamples, samples within this time of the previous one are ignored, which
/// limits memory and computing time.
constexpr double kMinStep_s = 0.0005;
/// Largest difference between the mean and standard gravity; low-cost sensors are off by a few
/// percent.
constexpr double kMaxScaleError_m_s2 = 0.5;
/// Largest root mean square deviation from the mean; a robot at rest vibrates less.
constexpr double kMaxNoise_m_s2 = 0.3;
/// Slower turns are attributed to the sensor's bias.
constexpr double kMaxTurn_rad_s = 0.1;
constexpr double kGravity_m_s2 = 9.80665;

bool isFinite(const InertialSample& sample) {
  return std::isfinite(sample.stamp_s) && sample.acceleration_m_s2.allFinite() &&
         (!sample.turn_rad_s || sample.turn_rad_s->allFinite());
}

}  // namespace

std::optional<Eigen::Vector3d> StillGravity::add(const InertialSample& sample) {
  if (!isFinite(sample)) return std::nullopt;
  if (!samples_.empty() && sample.stamp_s < samples_.back().stamp_s) samples_.clear();
  if (samples_.size() >= kMinSamples && sample.stamp_s < samples_.back().stamp_s + kMinStep_s) {
    return std::nullopt;
  }
  samples_.push_back(sample);
  // The oldest sample kept is at least kSpan_s old, so that the samples span that time.
  while (samples_.size() > 2 && samples_[1].stamp_s <= sample.stamp_s - kSpan_s) {
    samples_.pop_front();
  }
  return upIfStill();
}

std::optional<Eigen::Vector3d> StillGravity::upIfStill() const {
  const double span_s = samples_.back().stamp_s - samples_.front().stamp_s;
  if (samples_.size() < kMinSamples || span_s < kSpan_s) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const InertialSample& sample : samples_) mean += sample.acceleration_m_s2;
  mean /= static_cast<double>(samples_.size());
  if (std::abs(mean.norm() - kGravity_m_s2) > kMaxScaleError_m_s2) return std::nullopt;
  double squares = 0.0;
  for (const InertialSample& sample : samples_) {
    squares += (sample.acceleration_m_s2 - mean).squaredNorm();
    if (sample.turn_rad_s && sample.turn_rad_s->norm() > kMaxTurn_rad_s) return std::nullopt;
  }
  if (std::sqrt(squares / static_cast<double>(samples_.size())) > kMaxNoise_m_s2) {
    return std::nullopt;
  }
  return mean.normalized();
}

}  // namespace dtsdf
