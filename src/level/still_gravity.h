/// Finds the vertical from an accelerometer at rest.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

namespace dtsdf {

/// A sample of an inertial sensor, in its own frame.
struct InertialSample {
  double stamp_s;
  Eigen::Vector3d acceleration_m_s2;          ///< Points up at rest, as in REP 145.
  std::optional<Eigen::Vector3d> turn_rad_s;  ///< Angular velocity, if measured.
};

/// Finds the first second without motion. Not thread-safe.
class StillGravity {
 public:
  static constexpr double kSpan_s = 1.0;

  /// Adds a sample. @return the unit vector that points up, in the sensor's frame, if the last
  /// second was still. Ignores samples that are not finite and, once there are 20, samples within
  /// half a millisecond of the previous one. If a stamp goes back, the search starts over.
  std::optional<Eigen::Vector3d> add(const InertialSample& sample);

 private:
  std::optional<Eigen::Vector3d> upIfStill() const;

  std::deque<InertialSample> samples_;  ///< Samples of the last kSpan_s and one before them.
};

}  // namespace dtsdf
