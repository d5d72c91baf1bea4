#include "planning/ground_grid.h"

#include <algorithm>
#include <cmath>

namespace dtsdf {

std::vector<Eigen::Vector4f> sliceAt(const KnownSpace& space, double height_m) {
  const int32_t layer = space.cellAt({0.0, 0.0, height_m}).z;
  const double cell_size_m = space.cellSize_m();
  std::vector<Eigen::Vector4f> slice;
  for (const SpaceCube& cube : space.cubes(layer, layer)) {
    const auto z = static_cast<size_t>(layer - cube.first.z);
    for (uint64_t known = cube.free[z] | cube.surface[z]; known != 0; known &= known - 1) {
      const Vec3i cell = cube.cellOf(layer - cube.first.z, __builtin_ctzll(known));
      const Eigen::Vector3d p_W(cell_size_m * (cell.x + 0.5), cell_size_m * (cell.y + 0.5),
                                height_m);
      slice.emplace_back();
      slice.back() << p_W.cast<float>(), space.distanceAt(p_W).distance_m;
    }
  }
  return slice;
}

namespace {

constexpr int kCubeLog2 = SpaceCube::kSideLog2;

int32_t floorToStep(int32_t cell) {
  constexpr int32_t kStep = GroundGrid::kStep;
  return (cell >= 0 ? cell / kStep : -((-cell + kStep - 1) / kStep)) * kStep;
}

bool isZero(const SpaceCube::Mask& mask) {
  return std::all_of(mask.begin(), mask.end(), [](uint64_t word) { return word == 0; });
}

/// The box of a single column in a stack of cubes.
GridBox columnOf(int32_t stack_x, int32_t stack_y, size_t bit) {
  const SpaceCube stack{{stack_x * SpaceCube::kSide, stack_y * SpaceCube::kSide, 0}, {}, {}};
  const Vec3i cell = stack.cellOf(0, static_cast<int>(bit));
  return GridBox(Eigen::Vector2i(cell.x, cell.y));
}

}  // namespace

GridBox windowAround(const GridBox& known) {
  const auto floored = [](const Eigen::Vector2i& cell) {
    return Eigen::Vector2i(floorToStep(cell.x()), floorToStep(cell.y()));
  };
  constexpr int32_t kRest = GroundGrid::kStep - 1;
  return {floored(known.min()), floored(known.max()) + Eigen::Vector2i(kRest, kRest)};
}

uint64_t GroundGrid::keyOf(int32_t stack_x, int32_t stack_y) {
  return static_cast<uint64_t>(static_cast<uint32_t>(stack_y)) << 32 |
         static_cast<uint32_t>(stack_x);
}

/// Replaces a cube. @return box of the columns whose values change.
GridBox GroundGrid::put(const SpaceCube& cube) {
  if (cube.first.z > last_layer_ || cube.first.z + kSide - 1 < first_layer_) return {};
  SpaceCube part{cube.first, {}, {}};
  for (int z = 0; z < kSide; ++z) {
    const int32_t layer = cube.first.z + z;
    if (layer < first_layer_ || layer > last_layer_) continue;
    part.free[static_cast<size_t>(z)] = cube.free[static_cast<size_t>(z)];
    part.surface[static_cast<size_t>(z)] = cube.surface[static_cast<size_t>(z)];
  }
  const Vec3i at = SpaceCube::cubeOf(cube.first);
  const int32_t x = at.x, y = at.y;
  const bool is_unknown = isZero(part.free) && isZero(part.surface);
  auto place = stacks_.find(keyOf(x, y));
  if (place == stacks_.end()) {
    if (is_unknown) return {};
    place = stacks_.emplace(keyOf(x, y), Stack{}).first;
    place->second.values.fill(kColumnUnknown);
  }
  Stack& stack = place->second;
  const auto same =
      std::find_if(stack.parts.begin(), stack.parts.end(),
                   [&](const SpaceCube& other) { return other.first.z == part.first.z; });
  if (same != stack.parts.end()) stack.parts.erase(same);
  if (!is_unknown) stack.parts.push_back(part);
  const GridBox changed = evaluate(x, y, stack);
  if (stack.parts.empty()) stacks_.erase(place);
  return changed;
}

GridBox GroundGrid::evaluate(int32_t stack_x, int32_t stack_y, Stack& stack) const {
  std::array<int, kSide * kSide> free{};  // free cells in each column
  uint64_t surface = 0;
  for (const SpaceCube& part : stack.parts) {
    for (uint64_t word : part.free) {
      for (; word != 0; word &= word - 1) ++free[static_cast<size_t>(__builtin_ctzll(word))];
    }
    for (const uint64_t word : part.surface) surface |= word;
  }
  GridBox changed;
  for (size_t i = 0; i < stack.values.size(); ++i) {
    const int8_t value = (surface >> i & 1u) != 0 ? kColumnOccupied
                         : free[i] >= min_free_   ? kColumnFree
                                                  : kColumnUnknown;
    if (value == stack.values[i]) continue;
    stack.values[i] = value;
    changed.extend(columnOf(stack_x, stack_y, i));
  }
  return changed;
}

std::vector<int8_t> GroundGrid::values(const GridBox& box) const {
  if (box.isEmpty()) return {};
  const Eigen::Vector2i size = sizeOf(box);
  const auto width = static_cast<size_t>(size.x());
  std::vector<int8_t> values(width * static_cast<size_t>(size.y()), kColumnUnknown);
  for (int32_t stack_y = box.min().y() >> kCubeLog2; stack_y <= box.max().y() >> kCubeLog2;
       ++stack_y) {
    for (int32_t stack_x = box.min().x() >> kCubeLog2; stack_x <= box.max().x() >> kCubeLog2;
         ++stack_x) {
      const auto place = stacks_.find(keyOf(stack_x, stack_y));
      if (place == stacks_.end()) continue;
      const Eigen::Vector2i corner(stack_x * kSide, stack_y * kSide);
      const GridBox part =
          box.intersection(GridBox(corner, corner + Eigen::Vector2i(kSide - 1, kSide - 1)));
      for (int32_t y = part.min().y(); y <= part.max().y(); ++y) {
        for (int32_t x = part.min().x(); x <= part.max().x(); ++x) {
          values[static_cast<size_t>(y - box.min().y()) * width +
                 static_cast<size_t>(x - box.min().x())] =
              place->second.values[static_cast<size_t>(SpaceCube::bitOf(x, y))];
        }
      }
    }
  }
  return values;
}

/// Smallest box that contains all free and occupied columns.
GridBox GroundGrid::known() const {
  GridBox known;
  for (const auto& [key, stack] : stacks_) {
    const auto x = static_cast<int32_t>(static_cast<uint32_t>(key)),
               y = static_cast<int32_t>(static_cast<uint32_t>(key >> 32));
    for (size_t i = 0; i < stack.values.size(); ++i) {
      if (stack.values[i] == kColumnUnknown) continue;
      known.extend(columnOf(x, y, i));
    }
  }
  return known;
}

size_t GroundGrid::bytes() const {
  size_t parts = 0;
  for (const auto& [key, stack] : stacks_) parts += stack.parts.capacity();
  return stacks_.size() * (sizeof(uint64_t) + sizeof(Stack)) + parts * sizeof(SpaceCube);
}

void GroundGrid::beginAnew(double cell_size_m) {
  if (window_ && cell_size_m != cell_size_m_) {
    // The subscribers' grid has a different cell size.
    window_.reset();
    changed_ = {};
    is_outgrown_ = is_outdated_ = true;
  }
  if (window_) note(*window_);
  cell_size_m_ = cell_size_m;
  stacks_.clear();
  // Heights and cell size are rounded, so their ratio may be just off a whole number.
  constexpr double kTolerance = 1e-3;
  first_layer_ = static_cast<int32_t>(std::floor(min_m_ / cell_size_m + kTolerance));
  last_layer_ = std::max(first_layer_,
                         static_cast<int32_t>(std::ceil(max_m_ / cell_size_m - kTolerance)) - 1);
  const int layers = last_layer_ - first_layer_ + 1;
  min_free_ = std::max(1, static_cast<int>(std::ceil(seen_share_ * layers - 1e-6)));
}

void GroundGrid::note(const GridBox& columns) {
  if (columns.isEmpty()) return;
  is_outdated_ = true;
  if (!window_ || !window_->contains(columns)) is_outgrown_ = true;
  const GridBox inside = window_ ? window_->intersection(columns) : GridBox();
  if (!inside.isEmpty()) changed_.extend(inside);
}

void GroundGrid::apply(const SpaceChanges& changes, double cell_size_m) {
  if (changes.begins_anew || cell_size_m_ == 0.0) beginAnew(cell_size_m);
  for (const SpaceCube& cube : changes.cubes) note(put(cube));
}

/// The new window, if known columns lie outside the current one.
std::optional<GridBox> GroundGrid::grownWindow() {
  if (!is_outgrown_) return std::nullopt;
  const GridBox known = this->known();
  if (window_ && window_->contains(known)) {
    is_outgrown_ = false;
    return std::nullopt;
  }
  // If nothing is known, a window at the origin replaces the old grid, whose cell size differs.
  return windowAround(known.isEmpty() ? GridBox(Eigen::Vector2i::Zero()) : known);
}

GroundGrid::Pending GroundGrid::next() {
  too_large_.reset();
  if (!is_outdated_) return Pending::kNothing;
  is_outdated_ = false;
  if (const std::optional<GridBox> window = grownWindow()) {
    if (sizeOf(*window).cast<size_t>().prod() <= kMaxColumns) {
      is_outgrown_ = false;
      window_ = window;
      changed_ = {};
      return Pending::kGrid;
    }
    too_large_ = window;
  }
  return window_ && !changed_.isEmpty() ? Pending::kUpdate : Pending::kNothing;
}

}  // namespace dtsdf
