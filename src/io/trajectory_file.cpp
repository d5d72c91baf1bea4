#include "io/trajectory_file.h"

#include <cstdio>

#include "io/atomic_file.h"

#include <cmath>
#include <utility>

#include "io/list_file.h"

namespace dtsdf {
namespace {

StampedPose readPose(const ListLine& line) {
  if (line.words.size() != 8) throwAt(line, "expected 'stamp tx ty tz qx qy qz qw'");
  double v[8];
  for (size_t i = 0; i < 8; ++i) v[i] = numberAt(line, i);
  Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
  // Rounding to a few decimals leaves a small error; anything larger is not a rotation.
  if (std::abs(q.norm() - 1.0) > 0.01) throwAt(line, "the quaternion's length is not 1");
  StampedPose pose{v[0], Eigen::Isometry3d::Identity()};
  pose.T_W_C.linear() = q.normalized().toRotationMatrix();
  pose.T_W_C.translation() = Eigen::Vector3d(v[1], v[2], v[3]);
  return pose;
}

}  // namespace

Trajectory readTrajectory(const std::string& path, const std::string& advice) {
  std::vector<StampedPose> poses;
  for (const ListLine& line : readList(path, advice)) poses.push_back(readPose(line));
  return Trajectory(std::move(poses));
}

void saveTrajectory(const std::vector<StampedPose>& poses, const std::string& path) {
  std::string text = "# stamp tx ty tz qx qy qz qw: camera to world, in seconds and metres\n";
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d t = pose.T_W_C.translation();
    const Eigen::Quaterniond q(pose.T_W_C.linear());
    char line[256];
    std::snprintf(line, sizeof(line), "%.9f %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n", pose.stamp_s,
                  t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    text += line;
  }
  writeFileAtomically(path, text);
}

}  // namespace dtsdf
