#include "io/trajectory.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/atomic_file.h"
#include "io/text_file.h"
#include "params/text.h"
#include "poses/between.h"

namespace dtsdf {
namespace {

/// Added to tolerances, since doubles round current Unix times to a quarter of a microsecond.
constexpr double kStampResolution_s = 1e-6;

}  // namespace

Trajectory::Trajectory(std::vector<StampedPose> poses) : poses_(std::move(poses)) {
  const auto byStamp = [](const auto& a, const auto& b) { return a.stamp_s < b.stamp_s; };
  if (!std::is_sorted(poses_.begin(), poses_.end(), byStamp)) {  // stable_sort() allocates memory
    std::stable_sort(poses_.begin(), poses_.end(), byStamp);
  }
  poses_.erase(std::unique(poses_.begin(), poses_.end(),
                           [](const auto& a, const auto& b) { return a.stamp_s == b.stamp_s; }),
               poses_.end());
}

std::optional<Eigen::Isometry3d> Trajectory::poseAt(double stamp_s, double tolerance_s) const {
  const double reach_s = tolerance_s + kStampResolution_s;
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), stamp_s,
                       [](const StampedPose& pose, double stamp) { return pose.stamp_s < stamp; });
  const bool has_after = after != poses_.end(), has_before = after != poses_.begin();
  const bool after_is_near = has_after && after->stamp_s - stamp_s <= reach_s;
  const bool before_is_near = has_before && stamp_s - std::prev(after)->stamp_s <= reach_s;
  if (!after_is_near && !before_is_near) return std::nullopt;
  if (!has_before || (has_after && after->stamp_s == stamp_s)) return after->T_W_C;
  if (!has_after) return std::prev(after)->T_W_C;
  const StampedPose& before = *std::prev(after);
  return between(before.T_W_C, after->T_W_C,
                 (stamp_s - before.stamp_s) / (after->stamp_s - before.stamp_s));
}

std::optional<Eigen::Isometry3d> poseOf(const Eigen::Vector3d& t, const Eigen::Quaterniond& q) {
  if (!(std::abs(q.norm() - 1.0) <= 0.01)) return std::nullopt;
  return Eigen::Translation3d(t) * q.normalized();
}

std::string noPoseWithin(double tolerance_s) {
  return "no pose within " + std::to_string(std::lround(1000.0 * tolerance_s)) + " ms";
}

namespace {

StampedPose readPose(const ListLine& line) {
  if (line.words.size() != 8) throwAt(line, "expected 'stamp tx ty tz qx qy qz qw'");
  double v[8];
  for (size_t i = 0; i < 8; ++i) v[i] = numberAt(line, i);
  const auto T_W_C = poseOf({v[1], v[2], v[3]}, {v[7], v[4], v[5], v[6]});
  if (!T_W_C) throwAt(line, "the quaternion's length is not 1");
  return {v[0], *T_W_C};
}

}  // namespace

Trajectory readTrajectory(const std::string& path, const std::string& advice) {
  std::vector<StampedPose> poses;
  for (const ListLine& line : readList(path, advice)) poses.push_back(readPose(line));
  return Trajectory(std::move(poses));
}

std::string stampOfList(double stamp_s) {
  constexpr double kUnits = 1e6;  // doubles resolve current Unix times to this precision
  const bool is_whole = std::round(stamp_s * kUnits) / kUnits == stamp_s;
  return formatted(is_whole ? "%.6f" : "%.9f", stamp_s);
}

void saveTrajectory(const std::vector<StampedPose>& poses, const std::string& path) {
  std::string text = "# stamp tx ty tz qx qy qz qw: camera to world, in seconds and metres\n";
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d t = pose.T_W_C.translation();
    const Eigen::Quaterniond q(pose.T_W_C.linear());
    text += stampOfList(pose.stamp_s) + formatted(" %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n",
                                                  t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  writeFileAtomically(path, text);
}

}  // namespace dtsdf
