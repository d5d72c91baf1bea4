#include "level/floor.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "level/frame_points.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;
using Point = FloorView::Point;

constexpr double kMinCosine = 0.70710678118654752;  // cos(45 degrees), between normal and up
constexpr double kMinShare = 0.05;   // minimum fraction of all points that are on the floor
constexpr size_t kMinPoints = 100;   // minimum number of points on the floor
constexpr double kMaxBelow = 0.02;   // maximum fraction of points far below the floor (reflections)
constexpr double kFarBelow = 3.0;    // points this many tolerances below the floor are far below
constexpr double kMinWidth_m = 0.3;  // minimum width of 80 % of the points, in any direction
constexpr int kWidths = 18;          // number of directions in which the width is measured
/// If a tenth of the points below the camera are on the floor, only one search in 3000 fails to
/// draw three floor points at once.
constexpr int kDraws = 8000;
constexpr double kMinArea_m2 = 0.01;  // minimum area of the parallelogram of three drawn points
constexpr unsigned kSeed = 1;
constexpr size_t kScored = 2000;  // number of points used to score a drawn plane
constexpr int kRounds = 8;        // rounds of refinement
/// Smallest fraction of the tolerance used in refinement, even without noise.
constexpr double kMinScale = 0.1;

size_t countInliers(const FloorPlane& plane, const std::vector<Point>& points) {
  const auto on = std::count_if(points.begin(), points.end(), [&](const Point& point) {
    return std::abs(plane.signedDistance(point.p)) <= point.tolerance_m;
  });
  return static_cast<size_t>(on);
}

/// Whether hardly any points lie far below the plane.
bool isLowest(const FloorPlane& plane, const std::vector<Point>& points) {
  const auto below = std::count_if(points.begin(), points.end(), [&](const Point& point) {
    return plane.signedDistance(point.p) < -kFarBelow * point.tolerance_m;
  });
  return static_cast<double>(below) <= kMaxBelow * static_cast<double>(points.size());
}

/// Fits a plane to the points within `scale` tolerances, by weighted least squares.
/// @param median_error Receives the median error, in tolerances.
std::optional<FloorPlane> fitNear(const FloorPlane& start, const std::vector<Point>& points,
                                  double scale, double& median_error) {
  Vector3d sum = Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double weights = 0.0;
  std::vector<const Point*> near;
  for (const Point& point : points) {
    if (std::abs(start.signedDistance(point.p)) > scale * point.tolerance_m) continue;
    near.push_back(&point);
    const double weight = 1.0 / (point.tolerance_m * point.tolerance_m);
    weights += weight;
    sum += weight * point.p;
  }
  if (near.size() < 3) return std::nullopt;
  const Vector3d centre = sum / weights;
  for (const Point* point : near) {
    const Vector3d d = point->p - centre;
    squares += d * d.transpose() / (point->tolerance_m * point->tolerance_m);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / weights);
  Vector3d normal = axes.eigenvectors().col(0);
  if (normal.dot(start.normal()) < 0.0) normal *= -1.0;
  const FloorPlane plane(normal, centre);
  std::vector<double> errors;
  errors.reserve(near.size());
  for (const Point* point : near) {
    errors.push_back(std::abs(plane.signedDistance(point->p)) / point->tolerance_m);
  }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  median_error = *middle;
  return plane;
}

/// Fits the plane with a tolerance that shrinks to the actual noise, since the lowest points of
/// objects on the floor are within the full tolerance, too.
std::optional<FloorPlane> refine(const FloorPlane& start, const std::vector<Point>& points) {
  constexpr double kSigmaOfMedian = 1.4826;
  std::optional<FloorPlane> plane = start;
  double scale = 1.0, median_error = 0.0;
  for (int round = 0; round < kRounds && plane; ++round) {
    plane = fitNear(*plane, points, scale, median_error);
    scale = std::min(1.0, std::max(kMinScale, 3.0 * kSigmaOfMedian * median_error));
  }
  return plane;
}

/// Width, in the narrowest direction, of the area that the points on a plane cover. The outer tenth
/// on either side is ignored, since a tilted plane that cuts a wall contains a few points there.
double widthOf(const FloorPlane& plane, const std::vector<Point>& points) {
  const Vector3d u = plane.normal().unitOrthogonal(), v = plane.normal().cross(u);
  std::vector<Eigen::Vector2d> on;
  for (const Point& point : points) {
    if (std::abs(plane.signedDistance(point.p)) > point.tolerance_m) continue;
    on.emplace_back(u.dot(point.p), v.dot(point.p));
  }
  double width_m = std::numeric_limits<double>::infinity();
  std::vector<double> along(on.size());
  for (int i = 0; i < kWidths && !on.empty(); ++i) {
    const Eigen::Vector2d direction =
        Eigen::Rotation2Dd(M_PI * i / kWidths) * Eigen::Vector2d::UnitX();
    std::transform(on.begin(), on.end(), along.begin(),
                   [&](const Eigen::Vector2d& p) { return direction.dot(p); });
    std::sort(along.begin(), along.end());
    width_m = std::min(width_m, along[9 * on.size() / 10] - along[on.size() / 10]);
  }
  return width_m;
}

/// Picks at most `most` of the points, evenly spaced.
std::vector<Point> subsample(const std::vector<Point>& points, size_t most) {
  if (points.size() <= most) return points;
  std::vector<Point> chosen;
  chosen.reserve(most);
  for (size_t i = 0; i < most; ++i) chosen.push_back(points[i * points.size() / most]);
  return chosen;
}

/// Best plane through three randomly drawn candidates, scored with at most kScored points.
std::optional<FloorPlane> drawPlane(const std::vector<Point>& candidates,
                                    const std::vector<Point>& points, const Vector3d& up) {
  const std::vector<Point> scored = subsample(points, kScored);
  std::mt19937 random(kSeed);
  const auto draw = [&]() -> const Vector3d& { return candidates[random() % candidates.size()].p; };
  std::optional<FloorPlane> best;
  size_t best_on = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Vector3d &a = draw(), &b = draw(), &c = draw();
    Vector3d normal = (b - a).cross(c - a);
    const double area = normal.norm();
    if (area < kMinArea_m2) continue;
    normal /= normal.dot(up) < 0.0 ? -area : area;
    if (normal.dot(up) < kMinCosine) continue;
    const FloorPlane plane(normal, a);
    const size_t on = countInliers(plane, scored);
    if (on <= best_on || !isLowest(plane, scored)) continue;
    best_on = on;
    best = plane;
  }
  return best;
}

}  // namespace

std::optional<FloorPlane> fitFloor(const std::vector<FloorView>& views, std::string& problem) {
  const auto without = [&](const char* why) {
    problem = why;
    return std::nullopt;
  };
  std::vector<Point> points, below_camera;
  Vector3d up = Vector3d::Zero();
  for (const FloorView& view : views) {
    up += view.camera_up;
    for (const Point& point : view.points) {
      points.push_back(point);
      if ((point.p - view.camera).dot(view.camera_up) < 0.0) below_camera.push_back(point);
    }
  }
  const auto views_count = static_cast<double>(views.size());
  if (views.empty() || up.norm() < 0.5 * views_count) {
    return without("the camera turns too much to tell which way is up");
  }
  up.normalize();
  if (below_camera.size() < kMinPoints) return without("hardly any depth below the optical axis");
  const std::optional<FloorPlane> drawn = drawPlane(below_camera, points, up);
  if (!drawn) {
    return without("no lowest plane was found within 45 degrees of the camera's x-z plane");
  }
  std::optional<FloorPlane> fit = refine(*drawn, points);
  const size_t on = fit ? countInliers(*fit, points) : 0;
  const double least = kMinShare * static_cast<double>(points.size());
  if (on < kMinPoints || static_cast<double>(on) < least) {
    return without("the largest plane contains less than a twentieth of the measured points");
  }
  if (widthOf(*fit, points) < kMinWidth_m)
    return without("only a strip of a possible floor is visible");
  if (fit->normal().dot(up) < kMinCosine || !isLowest(*fit, points)) {
    return without("another plane lies below the largest one");
  }
  problem.clear();
  return fit;
}

namespace {

constexpr int kColumns = 48, kRows = 36;
/// Points farther away than this are too noisy for finding the floor.
constexpr double kMaxDepth_m = 6.0;

/// Three standard deviations of a low-cost sensor, whose noise grows with the square of depth.
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
  if (floor_ || !frame.T_W_C.matrix().allFinite()) return false;
  FloorView view = viewOf(frame);
  if (view.points.empty()) return false;
  views_.push_back(std::move(view));
  if (views_.size() < kViews) return false;
  finish();
  return true;
}

void FloorSearch::finish() {
  if (floor_ || (views_.empty() && !problem_.empty())) return;
  floor_ = fitFloor(views_, problem_);
  views_.clear();
}

}  // namespace dtsdf
