#include "planning/ground_grid.h"

#include <algorithm>
#include <cmath>

namespace dtsdf {

Eigen::Vector3d pointInSlice(const SliceCell& cell, double cell_size_m, double height_m) {
  return {cell_size_m * (cell.cell.x + 0.5), cell_size_m * (cell.cell.y + 0.5), height_m};
}

std::vector<SliceCell> sliceAt(const KnownSpace& space, double height_m) {
  const int32_t layer = space.cellAt({0.0, 0.0, height_m}).z;
  const double cell_size_m = space.cellSize_m();
  std::vector<SliceCell> slice;
  for (const SpaceCube& cube : space.cubes(layer, layer)) {
    const auto z = static_cast<size_t>(layer - cube.first.z);
    for (uint64_t known = cube.free[z] | cube.surface[z]; known != 0; known &= known - 1) {
      SliceCell cell{};
      cell.cell = cube.cellOf(layer - cube.first.z, __builtin_ctzll(known));
      cell.state = cube.stateOf(cell.cell);
      cell.distance_m = space.distanceAt(pointInSlice(cell, cell_size_m, height_m)).distance_m;
      slice.push_back(cell);
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

/// One column of a stack of cubes.
GridBox columnOf(int32_t stack_x, int32_t stack_y, size_t bit) {
  const SpaceCube stack{{stack_x * SpaceCube::kSide, stack_y * SpaceCube::kSide, 0}, {}, {}};
  const Vec3i cell = stack.cellOf(0, static_cast<int>(bit));
  return {cell.x, cell.y, 1, 1};
}

}  // namespace

bool GridBox::contains(const GridBox& other) const {
  return other.isEmpty() || (other.x >= x && other.y >= y && other.x + other.width <= x + width &&
                             other.y + other.height <= y + height);
}

GridBox unite(const GridBox& a, const GridBox& b) {
  if (a.isEmpty()) return b;
  if (b.isEmpty()) return a;
  const int32_t x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x,
          std::max(a.y + a.height, b.y + b.height) - y};
}

GridBox intersect(const GridBox& a, const GridBox& b) {
  const int32_t x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  const int32_t width = std::min(a.x + a.width, b.x + b.width) - x,
                height = std::min(a.y + a.height, b.y + b.height) - y;
  if (width <= 0 || height <= 0) return {};
  return {x, y, width, height};
}

GridBox windowAround(const GridBox& known) {
  constexpr int32_t kStep = GroundGrid::kStep;
  const int32_t x = floorToStep(known.x), y = floorToStep(known.y);
  return {x, y, floorToStep(known.x + known.width - 1) + kStep - x,
          floorToStep(known.y + known.height - 1) + kStep - y};
}

CellLayers layersBetween(const GroundHeights& heights, double cell_size_m) {
  // Sizes come from floats: a height that is a multiple of the cell's may be a little beside it.
  constexpr double kTolerance = 1e-3;
  const auto first = static_cast<int32_t>(std::floor(heights.min_m / cell_size_m + kTolerance));
  const auto last = static_cast<int32_t>(std::ceil(heights.max_m / cell_size_m - kTolerance)) - 1;
  return {first, std::max(first, last)};
}

uint64_t GroundColumns::keyOf(int32_t stack_x, int32_t stack_y) {
  return static_cast<uint64_t>(static_cast<uint32_t>(stack_y)) << 32 |
         static_cast<uint32_t>(stack_x);
}

GridBox GroundColumns::put(const SpaceCube& cube) {
  if (cube.first.z > layers_.last || cube.first.z + kSide - 1 < layers_.first) return {};
  SpaceCube part{cube.first, {}, {}};
  for (int z = 0; z < kSide; ++z) {
    const int32_t layer = cube.first.z + z;
    if (layer < layers_.first || layer > layers_.last) continue;
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

GridBox GroundColumns::evaluate(int32_t stack_x, int32_t stack_y, Stack& stack) const {
  std::array<int, kSide * kSide> free{};  // cells of each column
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
                         : free[i] >= least_free_ ? kColumnFree
                                                  : kColumnUnknown;
    if (value == stack.values[i]) continue;
    stack.values[i] = value;
    changed = unite(changed, columnOf(stack_x, stack_y, i));
  }
  return changed;
}

int8_t GroundColumns::at(int32_t x, int32_t y) const {
  const auto place = stacks_.find(keyOf(x >> kCubeLog2, y >> kCubeLog2));
  if (place == stacks_.end()) return kColumnUnknown;
  return place->second.values[static_cast<size_t>(SpaceCube::bitOf(x, y))];
}

/// Stack by stack, so that what is unknown costs nothing.
std::vector<int8_t> GroundColumns::values(const GridBox& box) const {
  std::vector<int8_t> values(box.size(), kColumnUnknown);
  if (box.isEmpty()) return values;
  const int32_t last_x = (box.x + box.width - 1) >> kCubeLog2,
                last_y = (box.y + box.height - 1) >> kCubeLog2;
  for (int32_t stack_y = box.y >> kCubeLog2; stack_y <= last_y; ++stack_y) {
    for (int32_t stack_x = box.x >> kCubeLog2; stack_x <= last_x; ++stack_x) {
      const auto place = stacks_.find(keyOf(stack_x, stack_y));
      if (place == stacks_.end()) continue;
      const GridBox part = intersect(box, {stack_x * kSide, stack_y * kSide, kSide, kSide});
      for (int32_t y = part.y; y < part.y + part.height; ++y) {
        for (int32_t x = part.x; x < part.x + part.width; ++x) {
          values[static_cast<size_t>(y - box.y) * static_cast<size_t>(box.width) +
                 static_cast<size_t>(x - box.x)] =
              place->second.values[static_cast<size_t>(SpaceCube::bitOf(x, y))];
        }
      }
    }
  }
  return values;
}

GridBox GroundColumns::known() const {
  GridBox known;
  for (const auto& [key, stack] : stacks_) {
    const auto x = static_cast<int32_t>(static_cast<uint32_t>(key)),
               y = static_cast<int32_t>(static_cast<uint32_t>(key >> 32));
    for (size_t i = 0; i < stack.values.size(); ++i) {
      if (stack.values[i] == kColumnUnknown) continue;
      known = unite(known, columnOf(x, y, i));
    }
  }
  return known;
}

size_t GroundColumns::bytes() const {
  size_t parts = 0;
  for (const auto& [key, stack] : stacks_) parts += stack.parts.capacity();
  return stacks_.size() * (sizeof(uint64_t) + sizeof(Stack)) + parts * sizeof(SpaceCube);
}

void GroundGrid::beginAnew(double cell_size_m) {
  if (window_ && cell_size_m != cell_size_m_) {
    // Nobody has a grid of such cells. What they have is of a map that is gone.
    window_.reset();
    changed_ = {};
    is_outgrown_ = is_outdated_ = true;
  }
  if (window_) note(*window_);
  cell_size_m_ = cell_size_m;
  columns_.emplace(heights_, cell_size_m);
}

void GroundGrid::note(const GridBox& columns) {
  if (columns.isEmpty()) return;
  is_outdated_ = true;
  if (!window_ || !window_->contains(columns)) is_outgrown_ = true;
  if (window_) changed_ = unite(changed_, intersect(*window_, columns));
}

void GroundGrid::apply(const SpaceChanges& changes, double cell_size_m) {
  if (changes.begins_anew || !columns_) beginAnew(cell_size_m);
  for (const SpaceCube& cube : changes.cubes) note(columns_->put(cube));
}

/// The window of all that is known, if the one that followers have does not hold it.
std::optional<GridBox> GroundGrid::outgrownTo() {
  if (!is_outgrown_) return std::nullopt;
  const GridBox known = columns_->known();
  if (window_ && window_->contains(known)) {
    is_outgrown_ = false;
    return std::nullopt;
  }
  // One of nothing takes the place of a grid of other cells.
  return windowAround(known.isEmpty() ? GridBox{0, 0, 1, 1} : known);
}

GroundGrid::Pending GroundGrid::next() {
  too_large_.reset();
  if (!is_outdated_) return Pending::kNothing;
  is_outdated_ = false;
  if (const std::optional<GridBox> window = outgrownTo()) {
    if (window->size() <= kMostColumns) {
      is_outgrown_ = false;
      window_ = window;
      changed_ = {};
      return Pending::kGrid;
    }
    too_large_ = window;
  }
  return window_ && !changed_.isEmpty() ? Pending::kUpdate : Pending::kNothing;
}

std::vector<int8_t> GroundGrid::values(const GridBox& box) const {
  return columns_ ? columns_->values(box) : std::vector<int8_t>(box.size(), kColumnUnknown);
}

}  // namespace dtsdf
