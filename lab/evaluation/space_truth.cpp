#include "evaluation/space_truth.h"

#include <algorithm>
#include <cmath>

namespace dtsdf {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

/// Points along an edge of a box that is looked through.
constexpr int kPointsAlong = 4;

Vector3d pointIn(const AlignedBox3d& box, int i) {
  const Vector3d share(i % kPointsAlong, i / kPointsAlong % kPointsAlong,
                       i / (kPointsAlong * kPointsAlong));
  return box.min() + (box.sizes().array() * share.array() / (kPointsAlong - 1)).matrix();
}

constexpr int cornerNumber(int corner) {
  constexpr int kLast = kPointsAlong - 1;
  return kLast * (corner & 1) + kPointsAlong * kLast * (corner >> 1 & 1) +
         kPointsAlong * kPointsAlong * kLast * (corner >> 2);
}

bool hasAllInView(const ViewCamera& camera, const Eigen::Isometry3d& T_C_W,
                  const AlignedBox3d& box_W, double max_range_m) {
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p_C = T_C_W * pointIn(box_W, cornerNumber(corner));
    if (p_C.z() > max_range_m || !isInImage(camera, p_C)) return false;
  }
  return true;
}

bool isAllClear(const SpaceTruth& truth, const Vector3d& eye_W, const AlignedBox3d& box_W) {
  for (int i = 0; i < kPointsAlong * kPointsAlong * kPointsAlong; ++i) {
    if (!truth.isClear(eye_W, pointIn(box_W, i))) return false;
  }
  return true;
}

}  // namespace

bool isInImage(const ViewCamera& camera, const Vector3d& p_C, double rim_px) {
  if (!(p_C.z() > 0.0)) return false;
  const Intrinsics& K = camera.intrinsics;
  const double u = static_cast<double>(K.fx) * p_C.x() / p_C.z() + static_cast<double>(K.cx) + 0.5,
               v = static_cast<double>(K.fy) * p_C.y() / p_C.z() + static_cast<double>(K.cy) + 0.5;
  return u >= rim_px && v >= rim_px && u <= camera.width - rim_px && v <= camera.height - rim_px;
}

bool isSeenThrough(const SpaceTruth& truth, const Views& views, const AlignedBox3d& box_W,
                   double max_range_m) {
  return std::any_of(views.poses_W_C.begin(), views.poses_W_C.end(),
                     [&](const Eigen::Isometry3d& T_W_C) {
                       return hasAllInView(views.camera, T_W_C.inverse(), box_W, max_range_m) &&
                              isAllClear(truth, T_W_C.translation(), box_W);
                     });
}

std::optional<TrueDistance> MeshTruth::distanceFrom(const Vector3d& p_W) const {
  const Eigen::Vector3f p = p_W.cast<float>();
  return TrueDistance{seen_.closestPoint(p).distance_m, all_.closestPoint(p).distance_m};
}

bool MeshTruth::isClear(const Vector3d& from_W, const Vector3d& to_W) const {
  return all_.isFree(from_W.cast<float>(), to_W.cast<float>(), 0.0f);
}

bool MeshTruth::isTaken(const AlignedBox3d& box_W) const { return seen_.reachesInto(box_W); }

std::optional<TrueDistance> SceneTruth::distanceFrom(const Vector3d& p_W) const {
  const double distance_m = scene_.signedDistance(p_W);
  Vector3d slope;
  constexpr double kStep_m = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kStep_m * Vector3d::Unit(axis);
    slope[axis] = scene_.signedDistance(p_W + step) - scene_.signedDistance(p_W - step);
  }
  const Vector3d nearest_W = p_W - distance_m * slope / (2.0 * kStep_m);
  if (!isSeen(nearest_W)) return std::nullopt;
  return TrueDistance{std::abs(distance_m), std::abs(distance_m)};
}

bool SceneTruth::isSeen(const Vector3d& p_W) const {
  constexpr double kRim_px = 3.0;     // the map wants neighbours of a pixel
  constexpr double kBefore_m = 1e-3;  // a point does not hide itself
  return std::any_of(views_.poses_W_C.begin(), views_.poses_W_C.end(),
                     [&](const Eigen::Isometry3d& T_W_C) {
                       const Vector3d to_eye = T_W_C.translation() - p_W;
                       return isInImage(views_.camera, T_W_C.inverse() * p_W, kRim_px) &&
                              isClear(T_W_C.translation(), p_W + kBefore_m * to_eye.normalized());
                     });
}

bool SceneTruth::isClear(const Vector3d& from_W, const Vector3d& to_W) const {
  return !(scene_.intersect(from_W, to_W - from_W) < 1.0);
}

/// Halves the box until the distance at its middle tells.
bool SceneTruth::isTaken(const AlignedBox3d& box_W) const {
  constexpr double kFine_m = 1e-4;
  const double at_middle = scene_.signedDistance(box_W.center()),
               half_diagonal = 0.5 * box_W.diagonal().norm();
  if (at_middle <= 0.0) return true;
  if (at_middle >= half_diagonal || half_diagonal < kFine_m) return false;
  for (int corner = 0; corner < 8; ++corner) {
    AlignedBox3d part(box_W.center(), box_W.center());
    part.extend(box_W.corner(static_cast<AlignedBox3d::CornerType>(corner)));
    if (isTaken(part)) return true;
  }
  return false;
}

}  // namespace dtsdf
