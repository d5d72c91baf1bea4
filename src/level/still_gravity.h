/// Which way is up, as an accelerometer measures it while it is held still.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

namespace dtsdf {

/// A sample of an inertial sensor, in its own frame.
struct InertialSample {
  double stamp_s;
  Eigen::Vector3d acceleration_m_s2;          ///< At rest it points up, as REP 145 has it.
  std::optional<Eigen::Vector3d> turn_rad_s;  ///< Where it is measured.
};

/// Looks for a second without motion. One thread at a time.
class StillGravity {
 public:
  static constexpr double kSpan_s = 1.0;

  /// Up in the sensor's frame, a unit vector, if the last second up to this sample was still. A
  /// sample that is not finite does not count; stamps that go back begin anew.
  std::optional<Eigen::Vector3d> add(const InertialSample& sample);

 private:
  std::optional<Eigen::Vector3d> upIfStill() const;

  std::deque<InertialSample> samples_;  ///< Samples of the last kSpan_s, in the order of stamps.
};

}  // namespace dtsdf
