#include "evaluation/path_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>

namespace dtsdf {
namespace {

using Eigen::Vector3d;

struct CellBefore {
  bool operator()(const Vec3i& a, const Vec3i& b) const {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  }
};

bool isSame(const Vec3i& a, const Vec3i& b) { return !CellBefore()(a, b) && !CellBefore()(b, a); }

/// How a cell was reached first at the least cost.
struct Reached {
  double cells = 0.0;  ///< Length of the way to it.
  Vec3i from{};
  bool is_done = false;
};

struct Waiting {
  double estimate;  ///< Length of the way through it, in cells.
  Vec3i cell;

  bool operator<(const Waiting& other) const { return estimate > other.estimate; }
};

Vector3d middleOf(const Space& space, const Vec3i& cell) {
  return space.cellSize_m() * Vector3d(cell.x + 0.5, cell.y + 0.5, cell.z + 0.5);
}

double cellsBetween(const Vec3i& a, const Vec3i& b) {
  return Vector3d(a.x - b.x, a.y - b.y, a.z - b.z).norm();
}

/// How far the search goes up and down from a cell.
enum class Steps { kAllAround, kLevel };

/// Allows(cell) says whether it may pass a cell.
template <class Allows>
class Search {
 public:
  Search(const Space& space, Steps steps, const Allows& allows)
      : space_(space), steps_(steps), allows_(allows) {}

  std::optional<Path> run(const Vec3i& start, const Vec3i& goal) {
    if (!allows_(start)) return std::nullopt;
    reached_[start] = {0.0, start};
    waiting_.push({cellsBetween(start, goal), start});
    while (!waiting_.empty()) {
      const Vec3i cell = waiting_.top().cell;
      waiting_.pop();
      if (isSame(cell, goal)) return pathTo(goal);
      Reached& here = reached_[cell];
      if (here.is_done) continue;
      here.is_done = true;
      const int first = steps_ == Steps::kLevel ? 9 : 0, end = steps_ == Steps::kLevel ? 18 : 27;
      for (int i = first; i < end; ++i) {
        const Vec3i next{cell.x + i % 3 - 1, cell.y + i / 3 % 3 - 1, cell.z + i / 9 - 1};
        reach(next, {here.cells + cellsBetween(cell, next), cell}, goal);
      }
    }
    return std::nullopt;
  }

 private:
  void reach(const Vec3i& cell, const Reached& by, const Vec3i& goal) {
    const auto known = reached_.find(cell);
    if (known != reached_.end() && (known->second.is_done || known->second.cells <= by.cells)) {
      return;
    }
    if (known == reached_.end() && !allows_(cell)) return;
    reached_[cell] = by;
    waiting_.push({by.cells + cellsBetween(cell, goal), cell});
  }

  Path pathTo(const Vec3i& goal) const {
    Path path;
    path.length_m = reached_.at(goal).cells * space_.cellSize_m();
    Vec3i cell = goal;
    path.points_W.push_back(middleOf(space_, cell));
    while (!isSame(reached_.at(cell).from, cell)) {
      cell = reached_.at(cell).from;
      path.points_W.push_back(middleOf(space_, cell));
    }
    std::reverse(path.points_W.begin(), path.points_W.end());
    return path;
  }

  const Space& space_;
  const Steps steps_;
  const Allows& allows_;
  std::map<Vec3i, Reached, CellBefore> reached_;
  std::priority_queue<Waiting> waiting_;
};

}  // namespace

bool Passage::allows(const Space& space, const Vec3i& cell) const {
  if (!bounds_W.contains(middleOf(space, cell))) return false;
  const CellState state = space.stateOf(cell);
  if (state == CellState::kSurface) return false;
  if (state == CellState::kUnknown && !through_unknown) return false;
  const int squared = space.squaredDistance(cell);
  return squared < 0 || std::sqrt(static_cast<double>(squared)) * space.cellSize_m() > radius_m;
}

GroundPassage::GroundPassage(Space& space, const GroundHeights& heights, const Passage& passage)
    : passage_(passage), cell_size_m_(space.cellSize_m()) {
  const Vec3i first = space.cellAt(passage.bounds_W.min()),
              last = space.cellAt(passage.bounds_W.max());
  box_ = {first.x, first.y, last.x - first.x + 1, last.y - first.y + 1};
  constexpr double kSeenShare = 0.5;  // as docs/results/space.md was measured
  GroundGrid grid({heights.min_m, heights.max_m, kSeenShare});
  SpaceChanges changes = space.takeChanges(true);
  grid.apply(changes, cell_size_m_);
  while (changes.is_part) grid.apply(changes = space.takeChanges(), cell_size_m_);
  values_ = grid.values(box_);
}

int8_t GroundPassage::valueAt(int32_t x, int32_t y) const {
  if (!box_.contains({x, y, 1, 1})) return kColumnUnknown;
  return values_[static_cast<size_t>(y - box_.y) * static_cast<size_t>(box_.width) +
                 static_cast<size_t>(x - box_.x)];
}

bool GroundPassage::allows(const Vec3i& column) const {
  if (!box_.contains({column.x, column.y, 1, 1})) return false;
  const int8_t value = valueAt(column.x, column.y);
  if (value == kColumnOccupied) return false;
  if (value == kColumnUnknown && !passage_.through_unknown) return false;
  const auto reach = static_cast<int32_t>(passage_.radius_m / cell_size_m_);
  for (int32_t y = -reach; y <= reach; ++y) {
    for (int32_t x = -reach; x <= reach; ++x) {
      const bool is_near =
          cell_size_m_ * std::sqrt(static_cast<double>(x * x + y * y)) <= passage_.radius_m;
      if (is_near && valueAt(column.x + x, column.y + y) == kColumnOccupied) return false;
    }
  }
  return true;
}

std::optional<Path> findPath(const Space& space, const Eigen::Vector3d& start_W,
                             const Eigen::Vector3d& goal_W, const Passage& passage) {
  const auto allows = [&](const Vec3i& cell) { return passage.allows(space, cell); };
  return Search(space, Steps::kAllAround, allows).run(space.cellAt(start_W), space.cellAt(goal_W));
}

std::optional<Path> findPath(const Space& space, const Eigen::Vector3d& start_W,
                             const Eigen::Vector3d& goal_W, const GroundPassage& passage) {
  const auto allows = [&](const Vec3i& column) { return passage.allows(column); };
  return Search(space, Steps::kLevel, allows).run(space.cellAt(start_W), space.cellAt(goal_W));
}

}  // namespace dtsdf
