#include "evaluation/space_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "evaluation/parallel.h"

namespace dtsdf {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr size_t kCellsPerChunk = 64;

AlignedBox3d boxOf(const Space& space, const Vec3i& cell) {
  const Vector3d low = space.cellSize_m() * Vector3d(cell.x, cell.y, cell.z);
  return {low, low + Vector3d::Constant(space.cellSize_m())};
}

AlignedBox3d shrunk(const AlignedBox3d& box) {
  const Vector3d margin = Vector3d::Constant(kBoxMargin_m);
  return {box.min() + margin, box.max() - margin};
}

struct Count {
  size_t value = 0;

  void merge(const Count& other) { value += other.value; }
};

template <class Sum>
struct TwoSums {
  Sum first, second;

  void merge(const TwoSums& other) {
    first.merge(other.first);
    second.merge(other.second);
  }
};

/// Sums up errors; from several threads by merging.
class ErrorSum {
 public:
  /// Beyond `most_m` a distance is as good as `most_m`, and says nothing where both are.
  ErrorSum(double cell_m, double most_m) : far_off_m_(kFarOff_cells * cell_m), most_m_(most_m) {}

  void add(const Vector3d& p_W, double told_m, const TrueDistance& truth) {
    if (told_m >= most_m_ && truth.to_seen_m >= most_m_) return;
    const double error_m = limited(told_m) - limited(truth.to_seen_m),
                 of_any_m = limited(told_m) - limited(truth.to_any_m);
    ++sums_.count;
    sums_.mean_m += error_m;
    sums_.rmse_m += error_m * error_m;
    if (of_any_m < -far_off_m_) ++sums_.far_below;
    if (error_m > far_off_m_) ++sums_.far_above;
    noteBounds(of_any_m, p_W, error_m, p_W);
  }

  void merge(const ErrorSum& other) {
    const DistanceErrors& o = other.sums_;
    sums_.count += o.count;
    sums_.mean_m += o.mean_m;
    sums_.rmse_m += o.rmse_m;
    sums_.far_below += o.far_below;
    sums_.far_above += o.far_above;
    noteBounds(o.least_m, o.least_at_W, o.greatest_m, o.greatest_at_W);
  }

  DistanceErrors result() const {
    DistanceErrors errors = sums_;
    const auto count = static_cast<double>(std::max<size_t>(1, errors.count));
    errors.mean_m /= count;
    errors.rmse_m = std::sqrt(errors.rmse_m / count);
    return errors;
  }

 private:
  double limited(double distance_m) const { return std::min(distance_m, most_m_); }

  void noteBounds(double least_m, const Vector3d& least_at_W, double greatest_m,
                  const Vector3d& greatest_at_W) {
    if (least_m < sums_.least_m) {
      sums_.least_m = least_m;
      sums_.least_at_W = least_at_W;
    }
    if (greatest_m > sums_.greatest_m) {
      sums_.greatest_m = greatest_m;
      sums_.greatest_at_W = greatest_at_W;
    }
  }

  double far_off_m_, most_m_;
  DistanceErrors sums_;  ///< The mean is a sum as yet, and the RMSE one of squares.
};

/// At most so many, spread evenly over all.
template <class Item>
std::vector<Item> thinned(const std::vector<Item>& all, size_t most) {
  if (all.size() <= most) return all;
  std::vector<Item> chosen;
  for (size_t i = 0; i < most; ++i) chosen.push_back(all[i * all.size() / most]);
  return chosen;
}

/// A point anywhere in a cell; the same for the same number.
Vector3d pointIn(const AlignedBox3d& box, size_t number) {
  std::mt19937_64 random(number);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Vector3d p;
  for (int axis = 0; axis < 3; ++axis) {
    p[axis] = box.min()[axis] + share(random) * box.sizes()[axis];
  }
  return p;
}

class Measurement {
 public:
  Measurement(const Space& space, const SpaceTruth& truth, const SpaceQuestions& questions)
      : space_(space), truth_(truth), questions_(questions) {}

  SpaceFigures run() {
    const std::vector<SpaceCell> known = space_.cells();
    std::vector<SpaceCell> free;
    std::copy_if(known.begin(), known.end(), std::back_inserter(free),
                 [](const SpaceCell& cell) { return cell.state == CellState::kFree; });
    figures_.cell_m = space_.cellSize_m();
    figures_.free_cells = free.size();
    figures_.surface_cells = known.size() - free.size();
    compareDistances(thinned(known, questions_.samples));
    lookIntoFree(thinned(free, questions_.samples));
    seekFree(boundsOf(known));
    return figures_;
  }

 private:
  void compareDistances(const std::vector<SpaceCell>& cells) {
    const ErrorSum none(space_.cellSize_m(), questions_.max_distance_m);
    const auto add = [&](size_t begin, size_t end, TwoSums<ErrorSum>& sums) {
      for (size_t i = begin; i < end; ++i) {
        const AlignedBox3d box = boxOf(space_, cells[i].cell);
        if (const auto truth = truth_.distanceFrom(box.center())) {
          sums.first.add(box.center(), toldAtMiddle(cells[i].cell), *truth);
        }
        const Vector3d p = pointIn(box, i);
        if (const auto truth = truth_.distanceFrom(p)) {
          sums.second.add(p, static_cast<double>(space_.distanceAt(p).distance_m), *truth);
        }
      }
    };
    const auto sums =
        sumOverChunks(cells.size(), kCellsPerChunk, TwoSums<ErrorSum>{none, none}, add);
    figures_.at_middles = sums.first.result();
    figures_.at_points = sums.second.result();
  }

  double toldAtMiddle(const Vec3i& cell) const {
    const int squared = space_.squaredDistance(cell);
    return squared < 0 ? std::numeric_limits<double>::infinity()
                       : std::sqrt(static_cast<double>(squared)) * space_.cellSize_m();
  }

  void lookIntoFree(const std::vector<SpaceCell>& free) {
    figures_.looked_at = free.size();
    const auto count = [&](size_t begin, size_t end, TwoSums<Count>& sums) {
      for (size_t i = begin; i < end; ++i) {
        const AlignedBox3d box = shrunk(boxOf(space_, free[i].cell));
        if (truth_.isTaken(box)) ++sums.first.value;
        if (!isSeenThrough(truth_, questions_.views, box, questions_.max_range_m)) {
          ++sums.second.value;
        }
      }
    };
    const auto sums = sumOverChunks(free.size(), kCellsPerChunk, TwoSums<Count>{}, count);
    figures_.taken = sums.first.value;
    figures_.unseen = sums.second.value;
  }

  /// First and last cell that something is known of, per axis.
  static std::array<Vec3i, 2> boundsOf(const std::vector<SpaceCell>& known) {
    std::array<Vec3i, 2> bounds{Vec3i{0, 0, 0}, Vec3i{-1, -1, -1}};
    if (known.empty()) return bounds;
    bounds = {known.front().cell, known.front().cell};
    for (const SpaceCell& k : known) {
      bounds[0] = {std::min(bounds[0].x, k.cell.x), std::min(bounds[0].y, k.cell.y),
                   std::min(bounds[0].z, k.cell.z)};
      bounds[1] = {std::max(bounds[1].x, k.cell.x), std::max(bounds[1].y, k.cell.y),
                   std::max(bounds[1].z, k.cell.z)};
    }
    return bounds;
  }

  static Vec3i cellIn(const std::array<Vec3i, 2>& bounds, size_t number) {
    std::mt19937_64 random(number);
    const auto along = [&](int32_t first, int32_t last) {
      return std::uniform_int_distribution<int32_t>(first, last)(random);
    };
    const int32_t x = along(bounds[0].x, bounds[1].x), y = along(bounds[0].y, bounds[1].y);
    return {x, y, along(bounds[0].z, bounds[1].z)};
  }

  void seekFree(const std::array<Vec3i, 2>& bounds) {
    if (bounds[0].x > bounds[1].x) return;
    const auto count = [&](size_t begin, size_t end, TwoSums<Count>& sums) {
      for (size_t i = begin; i < end; ++i) {
        const Vec3i cell = cellIn(bounds, i);
        const AlignedBox3d box = boxOf(space_, cell);
        if (truth_.isTaken(box) ||
            !isSeenThrough(truth_, questions_.views, box, questions_.max_range_m)) {
          continue;
        }
        ++sums.first.value;
        if (space_.stateOf(cell) == CellState::kFree) ++sums.second.value;
      }
    };
    const auto sums = sumOverChunks(questions_.samples, kCellsPerChunk, TwoSums<Count>{}, count);
    figures_.truly_free = sums.first.value;
    figures_.found_free = sums.second.value;
  }

  const Space& space_;
  const SpaceTruth& truth_;
  const SpaceQuestions& questions_;
  SpaceFigures figures_;
};

nlohmann::json toJsonValue(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

nlohmann::json toJsonValue(const DistanceErrors& errors) {
  return {{"count", errors.count},
          {"rmse_mm", 1e3 * errors.rmse_m},
          {"mean_mm", 1e3 * errors.mean_m},
          {"least_mm", 1e3 * errors.least_m},
          {"least_at", toJsonValue(errors.least_at_W)},
          {"greatest_mm", 1e3 * errors.greatest_m},
          {"greatest_at", toJsonValue(errors.greatest_at_W)},
          {"far_below", errors.far_below},
          {"far_above", errors.far_above}};
}

}  // namespace

SpaceFigures measureSpace(const Space& space, const SpaceTruth& truth,
                          const SpaceQuestions& questions) {
  return Measurement(space, truth, questions).run();
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
