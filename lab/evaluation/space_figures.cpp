#include "evaluation/space_figures.h"
#include "threads/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

namespace dtsdf {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

/// Number of test points along each edge of a box, for testing whether the box is free in a view.
constexpr int kPointsAlong = 4;

Vector3d gridPoint(const AlignedBox3d& box, int i) {
  const Vector3d share(i % kPointsAlong, i / kPointsAlong % kPointsAlong,
                       i / (kPointsAlong * kPointsAlong));
  return box.min() + (box.sizes().array() * share.array() / (kPointsAlong - 1)).matrix();
}

bool isInImage(const ViewCamera& camera, const Vector3d& p_C, double rim_px) {
  if (!(p_C.z() > 0.0)) return false;
  const Intrinsics& K = camera.intrinsics;
  const double u = static_cast<double>(K.fx) * p_C.x() / p_C.z() + static_cast<double>(K.cx) + 0.5,
               v = static_cast<double>(K.fy) * p_C.y() / p_C.z() + static_cast<double>(K.cy) + 0.5;
  return u >= rim_px && v >= rim_px && u <= camera.width - rim_px && v <= camera.height - rim_px;
}

AlignedBox3d boxOf(const Space& space, const Vec3i& cell, double margin_m) {
  const Vector3d low = space.cellSize_m() * Vector3d(cell.x, cell.y, cell.z);
  const Vector3d margin = Vector3d::Constant(margin_m);
  return {low + margin, low + Vector3d::Constant(space.cellSize_m()) - margin};
}

/// At most `most` of the cells, evenly spaced.
std::vector<SpaceCell> thinned(const std::vector<SpaceCell>& all, size_t most) {
  if (all.size() <= most) return all;
  std::vector<SpaceCell> chosen;
  for (size_t i = 0; i < most; ++i) chosen.push_back(all[i * all.size() / most]);
  return chosen;
}

/// A random point in a box. The same number gives the same point.
Vector3d randomPoint(const AlignedBox3d& box, size_t number) {
  std::mt19937_64 random(number);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const double x = share(random), y = share(random), z = share(random);
  return box.min() + box.sizes().cwiseProduct(Vector3d(x, y, z));
}

/// How many of the indices below `count` meet a condition.
template <class Condition>
size_t countIf(size_t count, const Condition& condition) {
  std::vector<char> holds(count);
  parallelFor<8>(count, 0, [&](size_t i) { holds[i] = condition(i); });
  return static_cast<size_t>(std::count(holds.begin(), holds.end(), 1));
}

/// @param errors_m Errors to summarise; those that are NaN are ignored.
DistanceErrors summarise(const std::vector<double>& errors_m, double cell_m) {
  DistanceErrors sums;
  for (const double error_m : errors_m) {
    if (std::isnan(error_m)) continue;
    if (++sums.count == 1) sums.least_m = sums.greatest_m = error_m;
    sums.mean_m += error_m;
    sums.rmse_m += error_m * error_m;
    sums.least_m = std::min(sums.least_m, error_m);
    sums.greatest_m = std::max(sums.greatest_m, error_m);
    sums.far_off += std::abs(error_m) > kFarOff_cells * cell_m;
  }
  const auto count = static_cast<double>(std::max<size_t>(1, sums.count));
  sums.mean_m /= count;
  sums.rmse_m = std::sqrt(sums.rmse_m / count);
  return sums;
}

double distanceFromMiddle(const Space& space, const Vec3i& cell) {
  const int squared = space.squaredDistance(cell);
  return squared < 0 ? std::numeric_limits<double>::infinity()
                     : std::sqrt(static_cast<double>(squared)) * space.cellSize_m();
}

void compareDistances(const Space& space, const SpaceTruth& truth, double max_distance_m,
                      const std::vector<SpaceCell>& cells, SpaceFigures& figures) {
  std::vector<double> at_middles(cells.size()), at_points(cells.size());
  // Distances beyond max_distance_m count as max_distance_m. If both distances are that large, they
  // are not compared.
  const auto error = [&](double distance_m, const Vector3d& p_W) {
    const std::optional<double> true_m = truth.distanceFrom(p_W);
    if (!true_m || (distance_m >= max_distance_m && *true_m >= max_distance_m)) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    return std::min(distance_m, max_distance_m) - std::min(*true_m, max_distance_m);
  };
  parallelFor<8>(cells.size(), 0, [&](size_t i) {
    const AlignedBox3d box = boxOf(space, cells[i].cell, 0.0);
    at_middles[i] = error(distanceFromMiddle(space, cells[i].cell), box.center());
    const Vector3d p_W = randomPoint(box, i);
    at_points[i] = error(static_cast<double>(space.distanceAt(p_W).distance_m), p_W);
  });
  figures.at_middles = summarise(at_middles, space.cellSize_m());
  figures.at_points = summarise(at_points, space.cellSize_m());
}

/// Counts truly free cells, among random cells within the bounds of the known cells, and how many
/// of them the map reports as free.
void countFreeCells(const Space& space, const SpaceTruth& truth, const SpaceQuestions& questions,
                    const std::vector<SpaceCell>& known, SpaceFigures& figures) {
  AlignedBox3d bounds;
  for (const SpaceCell& k : known) bounds.extend(boxOf(space, k.cell, 0.0));
  if (bounds.isEmpty()) return;
  const auto cellOf = [&](size_t i) { return space.cellAt(randomPoint(bounds, i)); };
  std::vector<char> is_free(questions.samples);
  figures.truly_free = countIf(questions.samples, [&](size_t i) {
    const AlignedBox3d box = boxOf(space, cellOf(i), 0.0);
    is_free[i] = !truth.isTaken(box) && truth.isSeenThrough(box, questions.max_range_m);
    return is_free[i] != 0;
  });
  figures.found_free = countIf(questions.samples, [&](size_t i) {
    return is_free[i] && space.stateOf(cellOf(i)) == CellState::kFree;
  });
}

nlohmann::json toJsonValue(const DistanceErrors& errors) {
  return {{"count", errors.count},
          {"rmse_mm", 1e3 * errors.rmse_m},
          {"mean_mm", 1e3 * errors.mean_m},
          {"least_mm", 1e3 * errors.least_m},
          {"greatest_mm", 1e3 * errors.greatest_m},
          {"far_off", errors.far_off}};
}

}  // namespace

std::optional<double> SpaceTruth::distanceFrom(const Vector3d& p_W) const {
  const double distance_m = viewed_.scene.signedDistance(p_W);
  Vector3d slope;
  constexpr double kStep_m = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kStep_m * Vector3d::Unit(axis);
    slope[axis] =
        viewed_.scene.signedDistance(p_W + step) - viewed_.scene.signedDistance(p_W - step);
  }
  if (!isSeen(p_W - distance_m * slope / (2.0 * kStep_m))) return std::nullopt;
  return std::abs(distance_m);
}

bool SpaceTruth::isSeen(const Vector3d& p_W) const {
  constexpr double kRim_px = 3.0;     // fusing a pixel needs its neighbours
  constexpr double kBefore_m = 1e-3;  // a point must not occlude itself
  const auto& poses_W_C = viewed_.views.poses_W_C;
  return std::any_of(poses_W_C.begin(), poses_W_C.end(), [&](const Eigen::Isometry3d& T_W_C) {
    const Vector3d to_eye = T_W_C.translation() - p_W;
    return isInImage(viewed_.views.camera, T_W_C.inverse() * p_W, kRim_px) &&
           isClear(T_W_C.translation(), p_W + kBefore_m * to_eye.normalized());
  });
}

bool SpaceTruth::isClear(const Vector3d& from_W, const Vector3d& to_W) const {
  return !(viewed_.scene.intersect(from_W, to_W - from_W) < 1.0);
}

/// Subdivides the box until the distance at the centre of each part is conclusive or the part is
/// tiny.
bool SpaceTruth::isTaken(const AlignedBox3d& box_W) const {
  constexpr double kFine_m = 1e-4;
  const double at_middle = viewed_.scene.signedDistance(box_W.center()),
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

bool SpaceTruth::isSeenThrough(const AlignedBox3d& box_W, double max_range_m) const {
  constexpr int kPoints = kPointsAlong * kPointsAlong * kPointsAlong;
  const auto seesThrough = [&](const Eigen::Isometry3d& T_W_C) {
    const Eigen::Isometry3d T_C_W = T_W_C.inverse();
    for (int i = 0; i < kPoints; ++i) {
      const Vector3d p_W = gridPoint(box_W, i), p_C = T_C_W * p_W;
      if (p_C.z() > max_range_m || !isInImage(viewed_.views.camera, p_C, 0.0)) return false;
    }
    for (int i = 0; i < kPoints; ++i) {
      if (!isClear(T_W_C.translation(), gridPoint(box_W, i))) return false;
    }
    return true;
  };
  const auto& poses_W_C = viewed_.views.poses_W_C;
  return std::any_of(poses_W_C.begin(), poses_W_C.end(), seesThrough);
}

SpaceFigures measureSpace(const Space& space, const SpaceTruth& truth,
                          const SpaceQuestions& questions) {
  const std::vector<SpaceCell> known = space.cells();
  std::vector<SpaceCell> free;
  std::copy_if(known.begin(), known.end(), std::back_inserter(free),
               [](const SpaceCell& cell) { return cell.state == CellState::kFree; });
  SpaceFigures figures;
  figures.cell_m = space.cellSize_m();
  figures.free_cells = free.size();
  figures.surface_cells = known.size() - free.size();
  compareDistances(space, truth, questions.max_distance_m, thinned(known, questions.samples),
                   figures);
  free = thinned(free, questions.samples);
  const auto boxOfFree = [&](size_t i) { return boxOf(space, free[i].cell, kBoxMargin_m); };
  figures.looked_at = free.size();
  figures.taken = countIf(free.size(), [&](size_t i) { return truth.isTaken(boxOfFree(i)); });
  figures.unseen = countIf(free.size(), [&](size_t i) {
    return !truth.isSeenThrough(boxOfFree(i), questions.max_range_m);
  });
  countFreeCells(space, truth, questions, known, figures);
  return figures;
}

std::string toJson(const SpaceFigures& figures) {
  const nlohmann::json json = {{"cell_mm", 1e3 * figures.cell_m},
                               {"free_cells", figures.free_cells},
                               {"surface_cells", figures.surface_cells},
                               {"at_middles", toJsonValue(figures.at_middles)},
                               {"at_points", toJsonValue(figures.at_points)},
                               {"looked_at", figures.looked_at},
                               {"taken", figures.taken},
                               {"unseen", figures.unseen},
                               {"truly_free", figures.truly_free},
                               {"found_free", figures.found_free}};
  return json.dump(2) + "\n";
}

}  // namespace dtsdf
