#include "evaluation/space_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>

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

/// Sums up errors; from several threads by merging.
class ErrorSum {
 public:
  /// Beyond `most_m` a distance is as good as `most_m`, and tells nothing where both are.
  void add(double told_m, double true_m, double most_m) {
    if (told_m >= most_m && true_m >= most_m) return;
    const double error_m = std::min(told_m, most_m) - std::min(true_m, most_m);
    ++count_;
    sum_ += error_m;
    squares_ += error_m * error_m;
    greatest_ = std::max(greatest_, std::abs(error_m));
  }
  void merge(const ErrorSum& other) {
    count_ += other.count_;
    sum_ += other.sum_;
    squares_ += other.squares_;
    greatest_ = std::max(greatest_, other.greatest_);
  }
  DistanceErrors result() const {
    if (count_ == 0) return {};
    const auto count = static_cast<double>(count_);
    return {count_, std::sqrt(squares_ / count), sum_ / count, greatest_};
  }

 private:
  size_t count_ = 0;
  double sum_ = 0.0, squares_ = 0.0, greatest_ = 0.0;
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
  for (int axis = 0; axis < 3; ++axis) p[axis] = box.min()[axis] + share(random) * box.sizes()[axis];
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
    const double most_m = questions_.max_distance_m;
    std::mutex mutex;  // guards the sums
    ErrorSum at_middles, at_points;
    parallelFor(cells.size(), kCellsPerChunk, [&](size_t begin, size_t end) {
      ErrorSum middles, points;
      for (size_t i = begin; i < end; ++i) {
        const AlignedBox3d box = boxOf(space_, cells[i].cell);
        if (const auto true_m = truth_.distanceFrom(box.center())) {
          middles.add(toldAtMiddle(cells[i].cell), *true_m, most_m);
        }
        const Vector3d p = pointIn(box, i);
        if (const auto true_m = truth_.distanceFrom(p)) {
          points.add(std::abs(static_cast<double>(space_.distanceAt(p).distance_m)), *true_m,
                     most_m);
        }
      }
      const std::lock_guard<std::mutex> lock(mutex);
      at_middles.merge(middles);
      at_points.merge(points);
    });
    figures_.at_middles = at_middles.result();
    figures_.at_points = at_points.result();
  }

  double toldAtMiddle(const Vec3i& cell) const {
    const int squared = space_.squaredDistance(cell);
    return squared < 0 ? std::numeric_limits<double>::infinity()
                       : std::sqrt(static_cast<double>(squared)) * space_.cellSize_m();
  }

  void lookIntoFree(const std::vector<SpaceCell>& free) {
    std::mutex mutex;  // guards the figures
    figures_.looked_at = free.size();
    parallelFor(free.size(), kCellsPerChunk, [&](size_t begin, size_t end) {
      size_t taken = 0, unseen = 0;
      for (size_t i = begin; i < end; ++i) {
        const AlignedBox3d box = shrunk(boxOf(space_, free[i].cell));
        if (truth_.isTaken(box)) ++taken;
        if (!isSeenThrough(truth_, questions_.views, box, questions_.max_range_m)) ++unseen;
      }
      const std::lock_guard<std::mutex> lock(mutex);
      figures_.taken += taken;
      figures_.unseen += unseen;
    });
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
    std::mutex mutex;  // guards the figures
    parallelFor(questions_.samples, kCellsPerChunk, [&](size_t begin, size_t end) {
      size_t truly_free = 0, found = 0;
      for (size_t i = begin; i < end; ++i) {
        const Vec3i cell = cellIn(bounds, i);
        const AlignedBox3d box = boxOf(space_, cell);
        if (truth_.isTaken(box) ||
            !isSeenThrough(truth_, questions_.views, box, questions_.max_range_m)) {
          continue;
        }
        ++truly_free;
        if (space_.stateOf(cell) == CellState::kFree) ++found;
      }
      const std::lock_guard<std::mutex> lock(mutex);
      figures_.truly_free += truly_free;
      figures_.found_free += found;
    });
  }

  const Space& space_;
  const SpaceTruth& truth_;
  const SpaceQuestions& questions_;
  SpaceFigures figures_;
};

nlohmann::json toJsonValue(const DistanceErrors& errors) {
  return {{"count", errors.count},
          {"rmse_mm", 1e3 * errors.rmse_m},
          {"mean_mm", 1e3 * errors.mean_m},
          {"greatest_mm", 1e3 * errors.greatest_m}};
}

}  // namespace

SpaceFigures measureSpace(const Space& space, const SpaceTruth& truth,
                          const SpaceQuestions& questions) {
  return Measurement(space, truth, questions).run();
}

std::vector<ToldDistance> readDistances(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<ToldDistance> told;
  std::array<float, 4> values{};
  while (file.read(reinterpret_cast<char*>(values.data()), sizeof(values))) {
    told.push_back({Vector3d(values[0], values[1], values[2]), values[3]});
  }
  if (told.empty() || file.gcount() != 0) {
    throw std::runtime_error(path + ": has to hold four 32-bit floats for each distance");
  }
  return told;
}

ComparedDistances compareDistances(const Space& space, const SpaceTruth& truth,
                                   const std::vector<ToldDistance>& told, double max_distance_m) {
  std::mutex mutex;  // guards the sums
  ErrorSum of_told, of_map;
  parallelFor(told.size(), kCellsPerChunk, [&](size_t begin, size_t end) {
    ErrorSum told_here, map_here;
    for (size_t i = begin; i < end; ++i) {
      const Vector3d& p = told[i].p_W;
      if (space.stateOf(space.cellAt(p)) != CellState::kFree) continue;
      const auto true_m = truth.distanceFrom(p);
      if (!true_m) continue;
      told_here.add(told[i].distance_m, *true_m, max_distance_m);
      map_here.add(static_cast<double>(space.distanceAt(p).distance_m), *true_m, max_distance_m);
    }
    const std::lock_guard<std::mutex> lock(mutex);
    of_told.merge(told_here);
    of_map.merge(map_here);
  });
  return {of_told.result(), of_map.result()};
}

std::string toJson(const SpaceFigures& figures, const std::optional<ComparedDistances>& compared) {
  nlohmann::json json = {{"cell_mm", 1e3 * figures.cell_m},
                         {"free_cells", figures.free_cells},
                         {"surface_cells", figures.surface_cells},
                         {"at_middles", toJsonValue(figures.at_middles)},
                         {"at_points", toJsonValue(figures.at_points)},
                         {"looked_at", figures.looked_at},
                         {"taken", figures.taken},
                         {"unseen", figures.unseen},
                         {"truly_free", figures.truly_free},
                         {"found_free", figures.found_free}};
  if (compared) {
    json["told"] = toJsonValue(compared->told);
    json["map_at_told"] = toJsonValue(compared->map);
  }
  return json.dump(2) + "\n";
}

}  // namespace dtsdf
