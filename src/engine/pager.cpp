#include "engine/pager.h"

#include <algorithm>
#include <unordered_set>
#include <utility>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "kernels/fusion/free_space.h"
#include "map/memory_budget.h"
#include "map/region_view.h"

namespace dtsdf {
namespace {

/// Approximate size of a batch of blocks to move. Blocks occupy memory twice while being moved.
constexpr size_t kBatchBytes = size_t{8} << 20;

/// Additional room to make, so that not every frame has to write blocks. It is small, so that
/// writing does not delay a frame for long.
size_t spareBytes(size_t budget_bytes) { return std::min(budget_bytes / 16, 4 * kBatchBytes); }

/// Blocks waiting to be written may occupy another 1 / kWaitingShare of the budget, but at most
/// kMaxWaitingBytes.
constexpr size_t kWaitingShare = 8;
constexpr size_t kMaxWaitingBytes = 4 * kBatchBytes;

/// After a failed write, nothing is written for this many calls to require() and noteFrame().
constexpr uint64_t kCallsBetweenTries = 16;

/// Maximum size of a block in memory.
constexpr size_t kMaxBytesOfBlock =
    BlockTable::kBlockBytes +
    kDirectionCount * (BlockTable::kArrayBytes + kBricksPerArray * BlockTable::kColourBytes);

/// Whether a step is a motion that can be extrapolated, rather than a jump of the pose or a switch
/// to another camera of a rig.
bool isMotion(const Eigen::Isometry3d& step, double max_depth_m) {
  constexpr double kMaxTurn_rad = 0.35, kMaxDepths = 0.25;
  return Eigen::AngleAxisd(step.linear()).angle() < kMaxTurn_rad &&
         step.translation().norm() < kMaxDepths * max_depth_m;
}

/// Number of frames for which to read ahead, and the step between the frames considered.
constexpr int kFramesAhead = 24, kFramesBetween = 3;

/// Blocks are read ahead once in this many frames.
constexpr uint64_t kFramesBetweenReads = 3;

/// Distance from the centre of the middle block of a coarse cell (BlockCells) to the cell's
/// farthest corner, in voxels.
constexpr float kCellReach = 0.8661f * static_cast<float>((BlockCells::kSide + 1) * kBlockSide);

BlockKey middleOf(const BlockCells::Cell& cell) {
  constexpr int32_t kSide = BlockCells::kSide, kHalf = kSide / 2;
  return {cell.key.x * kSide + kHalf, cell.key.y * kSide + kHalf, cell.key.z * kSide + kHalf};
}

/// Depth of a block's centre, in voxels.
float depthOf(const FrameView& view, const BlockKey& block) {
  constexpr float kHalf = 0.5f * static_cast<float>(kBlockSide);
  const Vec3f middle = toFloat(firstVoxelOfBlock(block - blockOfVoxel(view.origin_voxel))) +
                       Vec3f{kHalf, kHalf, kHalf};
  return rotateInverse(view.T_L_C, middle - view.T_L_C.t).z;
}

}  // namespace

Pager::Pager(const MapperParams& params, const Rules& rules, int threads, BlockTable& table)
    : params_(params),
      fusion_rules_(rules.fusion),
      threads_(threads),
      table_(table),
      budget_bytes_(table.budgetBytes()),
      batch_bytes_(std::min(kBatchBytes, spareBytes(budget_bytes_))),
      blocks_(params.map.page_folder, pageBytesOf(params.map),
              std::min(budget_bytes_ / kWaitingShare, kMaxWaitingBytes)) {}

size_t Pager::bytesOf(PackedKey key) const {
  const int32_t slot = table_.find(key);
  if (slot >= 0) return table_.bytesOf(slot);
  const int32_t number = blocks_.find(key);
  if (number < 0) return 0;
  const MapBlock& block = blocks_.block(number).block;
  return MapSize{1, static_cast<size_t>(__builtin_popcount(block.directions)),
                 static_cast<size_t>(__builtin_popcountll(block.bricks))}
      .bytes();
}

bool Pager::fits(const std::vector<PackedKey>& keys) const {
  if (keys.size() * kMaxBytesOfBlock <= budget_bytes_) return true;
  size_t bytes = 0;
  for (const PackedKey key : keys) bytes += bytesOf(key);
  return bytes <= budget_bytes_;
}

size_t Pager::trim(std::vector<PackedKey>& keys) const {
  size_t bytes = 0;
  const auto first = std::find_if(keys.begin(), keys.end(), [&](PackedKey key) {
    return (bytes += bytesOf(key)) > budget_bytes_;
  });
  const auto count = static_cast<size_t>(keys.end() - first);
  keys.erase(first, keys.end());
  return count;
}

void Pager::touch(int32_t slot) {
  const auto place = static_cast<size_t>(slot);
  if (last_need_.size() <= place) last_need_.resize(table_.slotCount(), 0);
  last_need_[place] = now_;
  table_.noteNeed(table_.block(slot).key, now_);
}

std::vector<int32_t> Pager::numbersOf(const std::vector<PackedKey>& keys) const {
  std::vector<int32_t> numbers;
  for (const PackedKey key : keys) {
    if (const int32_t number = blocks_.find(key); number >= 0) numbers.push_back(number);
  }
  return numbers;
}

bool Pager::isAnyPaged(const std::vector<PackedKey>& keys) const {
  return std::any_of(keys.begin(), keys.end(), [this](auto key) { return isPaged(key); });
}

size_t Pager::require(MapBackend& backend, const std::vector<PackedKey>& keys) {
  ++now_;
  for (const PackedKey key : keys) {
    if (const int32_t slot = table_.find(key); slot >= 0) touch(slot);
  }
  const std::vector<int32_t> numbers = numbersOf(keys);
  for (const int32_t number : numbers) blocks_.readAhead(number);
  for (size_t first = 0; first < numbers.size();) {
    size_t end = first, bytes = 0;
    for (; end < numbers.size() && (end == first || bytes < batch_bytes_); ++end) {
      bytes += bytesOf(blocks_.keyOf(numbers[end]));
    }
    // If the disk is full, reading this batch makes room on it for other blocks.
    if (!makeRoom(backend, bytes) && !hasRoom(0)) break;
    table_.setBudget(std::max(budget_bytes_, table_.bytesInUse() + bytes));
    const size_t staying = readBatch(backend, {numbers.begin() + static_cast<std::ptrdiff_t>(first),
                                               numbers.begin() + static_cast<std::ptrdiff_t>(end)});
    // If no block could be read, stops evicting for a while. Otherwise the disk has room again.
    no_writes_before_ = staying == end - first ? now_ + kCallsBetweenTries : 0;
    first = end;
  }
  makeRoom(backend, 0);
  return numbersOf(keys).size();
}

bool Pager::makeRoom(MapBackend& backend, size_t bytes) {
  table_.setBudget(budget_bytes_);
  if (hasRoom(bytes)) return true;
  evict(backend, bytes + spareBytes(budget_bytes_), now_ + 1);
  const bool exceeds = !hasRoom(bytes) && leastRecentlyNeeded(1, now_ + 1).empty();
  table_.setBudget(exceeds ? table_.bytesInUse() + bytes : budget_bytes_);
  return exceeds || hasRoom(bytes);
}

/// Evicts blocks until there is room for `bytes`, no block is left to evict, or a batch cannot be
/// written. In the last case, nothing is written until now_ reaches no_writes_before_.
/// @param before Only cells last needed before this value of now_ are evicted.
void Pager::evict(MapBackend& backend, size_t bytes, uint64_t before) {
  if (now_ < no_writes_before_) return;
  const std::vector<int32_t> slots =
      leastRecentlyNeeded(table_.bytesInUse() + bytes - budget_bytes_, before);
  std::vector<int32_t> batch;
  size_t batch_bytes = 0;
  for (const int32_t slot : slots) {
    batch.push_back(slot);
    batch_bytes += table_.bytesOf(slot);
    if (batch_bytes < batch_bytes_ && slot != slots.back()) continue;
    if (!writeBatch(backend, batch)) {
      no_writes_before_ = now_ + kCallsBetweenTries;
      return;
    }
    batch.clear();
    batch_bytes = 0;
  }
}

/// Selects blocks to evict, at least `bytes` in total if possible, except those requested by the
/// last require(). Starts with the coarse cells that have not been needed for the longest time;
/// keys break ties.
std::vector<int32_t> Pager::leastRecentlyNeeded(size_t bytes, uint64_t before) const {
  std::vector<const BlockCells::Cell*> cells;
  for (const BlockCells::Cell& cell : table_.cells()) {
    if (cell.last_need < before) cells.push_back(&cell);
  }
  std::sort(cells.begin(), cells.end(), [](const auto* a, const auto* b) {
    return a->last_need != b->last_need ? a->last_need < b->last_need
                                        : packKey(a->key) < packKey(b->key);
  });
  std::vector<int32_t> slots;
  size_t found = 0;
  for (const BlockCells::Cell* cell : cells) {
    for (const int32_t slot : cell->slots) {
      if (found >= bytes) return slots;
      const auto place = static_cast<size_t>(slot);
      const bool is_needed = place < last_need_.size() && last_need_[place] == now_;
      if (is_needed || directionsWithArrays(table_.block(slot)) == 0) continue;
      found += table_.bytesOf(slot);
      slots.push_back(slot);
    }
  }
  return slots;
}

std::vector<PackedKey> Pager::neededKeys(MapBackend& backend, const FrameView& view,
                                         const TouchedBlocks& touched,
                                         const std::vector<int32_t>& in_view,
                                         uint64_t frame_number) const {
  const bool moves = !hasRoom(MapSize{touched.requests.size(), touched.new_arrays}.bytes()) ||
                     std::any_of(touched.requests.begin(), touched.requests.end(),
                                 [this](const BlockRequest& one) { return isPaged(one.key); });
  std::vector<PackedKey> others;
  if (clearsFreeSpace(params_) && !isEmpty()) {
    const BlockKey origin = blockOfVoxel(view.origin_voxel);
    others = blocks_.keysInView(view, kFootRadius, [](const BlockCells::Cell&) { return true; });
    const auto is_unseen = [&](PackedKey key) {
      return !isInTurn(key, frame_number, fusion_rules_) ||
             !mayBeInView(view, unpackKey(key) - origin);
    };
    others.erase(std::remove_if(others.begin(), others.end(), is_unseen), others.end());
  }
  if (!moves && others.empty()) return {};
  for (const int32_t slot : in_view) {
    if (table_.block(slot).in_use) others.push_back(packKey(table_.block(slot).key));
  }
  std::vector<PackedKey> keys = backend.neededKeys(others, frame_number);
  sortUnique(keys);
  if (!moves && !isAnyPaged(keys)) keys.clear();
  return keys;
}

std::vector<PackedKey> Pager::keysInView(const FrameView& view, float radius,
                                         float max_depth_m) const {
  const float max_depth = max_depth_m / view.voxel_size_m + radius;
  const BlockKey origin = blockOfVoxel(view.origin_voxel);
  std::vector<PackedKey> keys =
      blocks_.keysInView(view, radius, [](const BlockCells::Cell&) { return true; });
  for (const int32_t slot : table_.slotsInView(view, radius)) {
    keys.push_back(packKey(table_.block(slot).key));
  }
  std::vector<std::pair<float, PackedKey>> by_depth;
  for (const PackedKey key : keys) {
    const BlockKey block = unpackKey(key);
    const float depth = depthOf(view, block);
    if (mayBeInView(view, block - origin, radius) && depth <= max_depth) {
      by_depth.emplace_back(depth, key);
    }
  }
  std::sort(by_depth.begin(), by_depth.end());
  keys.clear();
  for (const auto& [depth, key] : by_depth) keys.push_back(key);
  return keys;
}

bool Pager::mayShow(const FrameView& view, float radius) const {
  bool may_show = false;
  blocks_.keysInView(view, radius, [&](const BlockCells::Cell&) {
    may_show = true;
    return false;
  });
  return may_show;
}

std::vector<PackedKey> Pager::keysIn(const RegionView& region) const {
  return blocks_.keysWhere(
      [](const auto&) { return true; },
      [&](int32_t number) { return mayBeInside(region, blocks_.block(number).block.key); });
}

std::vector<PackedKey> Pager::keysBeyond(const RegionView& kept) const {
  const double cell_radius = std::max(kept.radius - double{kCellReach}, 0.0);
  const auto distance = [&kept](const BlockKey& block) {
    return squaredDistance(block, kept.center);
  };
  return blocks_.keysWhere(
      [&](const auto& cell) { return distance(middleOf(cell)) >= cell_radius * cell_radius; },
      [&](int32_t number) {
        return distance(blocks_.block(number).block.key) > kept.radius * kept.radius;
      });
}

void Pager::noteFrame(const DepthFrame& frame, const FrameView& view) {
  ++now_;
  const BlockKey origin = blockOfVoxel(view.origin_voxel);
  table_.visitCellsInView(view, kFootRadius, [&](const BlockCells::Cell& cell) {
    const auto seen = std::find_if(cell.slots.begin(), cell.slots.end(), [&](int32_t slot) {
      return mayBeInView(view, table_.block(slot).key - origin);
    });
    if (seen != cell.slots.end()) table_.noteNeed(table_.block(*seen).key, now_);
  });
  if (++frames_ % kFramesBetweenReads == 0 && T_W_C_before_) {
    const Eigen::Isometry3d motion = T_W_C_before_->inverse() * frame.T_W_C;
    ahead_of_ = frame;
    motion_.reset();
    if (isMotion(motion, params_.fusion.max_depth_m)) motion_ = motion;
  }
  T_W_C_before_ = frame.T_W_C;
}

/// Blocks on disk in the coarse cells that will be in view if the camera's motion continues, sorted
/// by when they are needed; possibly more than can be loaded. For cells in memory that will be in
/// view, notes that they are needed.
std::vector<PackedKey> Pager::keysAhead(DepthFrame ahead) {
  const size_t most =
      spareBytes(budget_bytes_) / (BlockTable::kBlockBytes + BlockTable::kArrayBytes);
  std::vector<PackedKey> keys;
  std::unordered_set<PackedKey> known;
  for (int step = 0; step <= kFramesAhead && keys.size() < most; ++step) {
    if (step > 0 && motion_) ahead.T_W_C = ahead.T_W_C * *motion_;
    if (step % kFramesBetween != 0 || findProblem(ahead, params_)) continue;
    const FrameView view = makeFrameView(ahead, params_.map.voxel_size_m);
    table_.visitCellsInView(view, kMeshedRadius, [this](const BlockCells::Cell& cell) {
      table_.noteNeed(table_.block(cell.slots.front()).key, now_);
    });
    const float max_depth =
        params_.fusion.max_depth_m / view.voxel_size_m + kMeshedRadius + kCellReach;
    const std::vector<PackedKey> some =
        blocks_.keysInView(view, kMeshedRadius, [&](const BlockCells::Cell& cell) {
          return depthOf(view, middleOf(cell)) <= max_depth &&
                 known.insert(packKey(cell.key)).second;
        });
    keys.insert(keys.end(), some.begin(), some.end());
    if (!motion_) break;
  }
  return keys;
}

/// Blocks that were read ahead are usually in the page cache by now.
void Pager::moveBetweenFrames(MapBackend& backend) {
  if (const auto frame = std::exchange(ahead_of_, std::nullopt); frame && !isEmpty()) {
    ahead_ = keysAhead(*frame);
    for (const int32_t number : numbersOf(ahead_)) blocks_.readAhead(number);
    next_ahead_ = 0;
    blocks_per_frame_ =
        motion_ ? (ahead_.size() + kFramesBetweenReads - 1) / kFramesBetweenReads : 0;
    kept_since_ = now_;
  }
  const size_t spare = spareBytes(budget_bytes_);
  if (!hasRoom(spare)) evict(backend, spare, kept_since_);
  const size_t end = std::min(ahead_.size(), next_ahead_ + blocks_per_frame_);
  if (next_ahead_ == end) return;
  const auto at = [this](size_t i) { return ahead_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::vector<int32_t> numbers = numbersOf({at(next_ahead_), at(end)});
  next_ahead_ = end;
  size_t bytes = 0;
  for (const int32_t number : numbers) bytes += bytesOf(blocks_.keyOf(number));
  if (!numbers.empty() && hasRoom(bytes)) readBatch(backend, std::move(numbers));
}

void Pager::clear() {
  blocks_.clear();
  last_need_.clear();
  T_W_C_before_.reset();
  ahead_of_.reset();
  ahead_.clear();
  dropped_.clear();
  next_ahead_ = blocks_per_frame_ = 0;
  kept_since_ = no_writes_before_ = 0;
  frames_ = written_ = read_ = 0;
}

PageStats Pager::stats() const {
  PageStats stats = blocks_.store().stats();
  stats.blocks = blocks_.count();
  stats.index_bytes += blocks_.indexBytes();
  stats.written = written_;
  stats.read = read_;
  return stats;
}

}  // namespace dtsdf
