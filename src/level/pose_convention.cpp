#include "level/pose_convention.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "level/frame_points.h"

namespace dtsdf {
namespace {

/// Points along each edge of the thinned image.
constexpr int kSamples = 24;
/// The camera has to move so far between two images that are compared, or turn.
constexpr double kMinMotion_m = 0.05, kMinTurn_rad = 0.1;
/// Depths that differ by a smaller share are of one surface.
constexpr double kSameDepth = 0.03;
/// For a pair of images to distinguish the ways, so large a share of the points in view has to be
/// found by one, and so much less by what it is compared with.
constexpr double kFound = 0.65, kLess = 0.25;
constexpr int kMinInView = 60;
/// Pairs that make a verdict, and how many have to agree.
constexpr int kPairs = 8, kMajority = 7;

constexpr const char* kDoubts[] = {
    "",
    "poses fit far better as those of the camera's body: its x axis seems to point forward, but z "
    "must; give poses of the optical frame (in the driver, by input/camera_frame, or reconstruct "
    "--pose-convention body), then clear the map",
    "poses fit far better as those of OpenGL, with y up and z backwards: multiply each from the "
    "right by diag(1, -1, -1, 1), or give reconstruct --pose-convention opengl",
    "poses fit far better as those from the map to the camera: invert each, or give reconstruct "
    "--pose-convention inverted"};

/// To the axes of the optical frame from those that the poses are of.
Eigen::Isometry3d axesOf(size_t way) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (way == 1) T.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  if (way == 2) T.linear().diagonal() << 1, -1, -1;
  return T;
}

/// The share of the points that are where the image sees a surface, moved into its optical frame.
double shareFound(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& motion,
                  const DepthFrame& frame) {
  const Intrinsics& K = frame.intrinsics;
  int in_view = 0, found = 0;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = motion * point;
    if (p.z() <= 0.0) continue;
    const double u = K.fx * p.x() / p.z() + K.cx, v = K.fy * p.y() / p.z() + K.cy;
    if (!(u >= 0.0 && v >= 0.0 && u <= frame.width - 1 && v <= frame.height - 1)) continue;
    const double z =
        depthAt(frame, static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v)));
    if (z <= 0.0) continue;
    ++in_view;
    if (std::abs(z - p.z()) < kSameDepth * z) ++found;
  }
  return in_view < kMinInView ? 0.0 : static_cast<double>(found) / in_view;
}

}  // namespace

void PoseConvention::add(const DepthFrame& frame) {
  if (is_done_) return;
  const Eigen::Isometry3d motion = T_W_C_.inverse() * frame.T_W_C;
  if (!points_.empty() && motion.translation().norm() < kMinMotion_m &&
      Eigen::AngleAxisd(motion.linear()).angle() < kMinTurn_rad) {
    return;
  }
  if (!points_.empty()) judge(frame);
  points_ = thinnedPoints(frame, kSamples, kSamples);
  T_W_C_ = frame.T_W_C;
}

void PoseConvention::judge(const DepthFrame& frame) {
  const Eigen::Isometry3d given = frame.T_W_C.inverse() * T_W_C_;
  std::array<double, kWays> shares{};
  for (size_t way = 0; way < kWays; ++way) {
    const Eigen::Isometry3d axes = axesOf(way);
    const Eigen::Isometry3d motion =
        way == 3 ? frame.T_W_C * T_W_C_.inverse() : axes.inverse() * given * axes;
    shares[way] = shareFound(points_, motion, frame);
  }
  const auto best = std::max_element(shares.begin(), shares.end());
  const double other =
      best == shares.begin() ? *std::max_element(best + 1, shares.end()) : shares.front();
  if (*best < kFound || *best - other < kLess) return;
  ++pairs_[static_cast<size_t>(best - shares.begin())];
  if (std::accumulate(pairs_.begin(), pairs_.end(), 0) < kPairs) return;
  is_done_ = true;
  const auto most = std::max_element(pairs_.begin(), pairs_.end());
  if (*most >= kMajority) doubt_ = kDoubts[most - pairs_.begin()];
}

}  // namespace dtsdf
