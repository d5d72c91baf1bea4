#include "level/floor_search.h"

#include "level/frame_points.h"

namespace dtsdf {
namespace {

constexpr int kColumns = 48, kRows = 36;
/// Farther away, the noise of depth is larger than what a floor is known by.
constexpr double kMaxDepth_m = 6.0;

/// Three standard deviations of cheap sensors, whose noise grows with the square of depth.
double toleranceAt(double depth_m) { return 0.01 + 0.003 * depth_m * depth_m; }

FloorView viewOf(const DepthFrame& frame) {
  FloorView view;
  view.camera = frame.T_W_C.translation();
  view.camera_up = -frame.T_W_C.linear().col(1).normalized();
  for (const Eigen::Vector3d& p_C : thinnedPoints(frame, kColumns, kRows)) {
    if (!p_C.allFinite() || p_C.z() > kMaxDepth_m) continue;
    view.points.push_back({frame.T_W_C * p_C, toleranceAt(p_C.z())});
  }
  return view;
}

}  // namespace

bool FloorSearch::add(const DepthFrame& frame) {
  if (fit_.floor || !frame.T_W_C.matrix().allFinite()) return false;
  FloorView view = viewOf(frame);
  if (view.points.empty()) return false;
  views_.push_back(std::move(view));
  if (views_.size() < kViews) return false;
  finish();
  return true;
}

void FloorSearch::finish() {
  if (fit_.floor || (views_.empty() && !fit_.problem.empty())) return;
  fit_ = fitFloor(views_);
  views_.clear();
}

}  // namespace dtsdf
