#include "level/pose_convention.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "level/frame_points.h"

namespace dtsdf {
namespace {

/// Number of points along each edge of the thinned image.
constexpr int kSamples = 24;
/// Minimum motion or turn of the camera between two compared images.
constexpr double kMinMotion_m = 0.05, kMinTurn_rad = 0.1;
/// Largest relative difference between depths on the same surface.
constexpr double kSameDepth = 0.03;
/// A pair of images counts if, with the best convention, at least the fraction kFound of the points
/// in view lie on measured surfaces, and if this fraction exceeds that of the assumed convention by
/// at least kMinLead. If the assumed convention is the best, its fraction is compared with that of
/// the second best instead.
constexpr double kFound = 0.65, kMinLead = 0.25;
constexpr int kMinInView = 60;
/// Number of pairs needed for a verdict, and how many of them must agree.
constexpr int kPairs = 8, kMajority = 7;

constexpr const char* kDoubts[] = {
    "",
    "the poses seem to be those of the camera's body (x forward), not of its optical frame (z "
    "forward); use poses of the optical frame (change the driver, set input/camera_frame, or run "
    "reconstruct with --pose-convention body), then clear the map",
    "the poses seem to be those of OpenGL (y up, z backwards); multiply each on the right by "
    "diag(1, -1, -1, 1), or run reconstruct with --pose-convention opengl",
    "the poses seem to be inverted, from the map to the camera; invert each, or run "
    "reconstruct with --pose-convention inverted"};

/// Transform from the axes of the optical frame to the axes of the poses' convention.
Eigen::Isometry3d axesOf(size_t way) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (way == 1) T.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  if (way == 2) T.linear().diagonal() << 1, -1, -1;
  return T;
}

/// The fraction of points that lie on the surfaces in an image, among the points that project onto
/// measured pixels; 0 if these are too few.
/// @param motion From the points' frame to the image's.
double inlierShare(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& motion,
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
  std::array<double, kConventions> shares{};
  for (size_t way = 0; way < kConventions; ++way) {
    const Eigen::Isometry3d axes = axesOf(way);
    const Eigen::Isometry3d motion =
        way == 3 ? frame.T_W_C * T_W_C_.inverse() : axes.inverse() * given * axes;
    shares[way] = inlierShare(points_, motion, frame);
  }
  const auto best = std::max_element(shares.begin(), shares.end());
  const double other =
      best == shares.begin() ? *std::max_element(best + 1, shares.end()) : shares.front();
  if (*best < kFound || *best - other < kMinLead) return;
  ++pairs_[static_cast<size_t>(best - shares.begin())];
  if (std::accumulate(pairs_.begin(), pairs_.end(), 0) < kPairs) return;
  is_done_ = true;
  const auto most = std::max_element(pairs_.begin(), pairs_.end());
  if (*most >= kMajority) doubt_ = kDoubts[most - pairs_.begin()];
}

}  // namespace dtsdf
