// Which blocks views show, and which of them come next.
#include <algorithm>
#include <unordered_set>
#include <utility>

#include "backend/frame_check.h"
#include "engine/pager.h"
#include "kernels/fusion/free_space.h"
#include "map/region_view.h"

namespace dtsdf {
namespace {

/// Between two images of one camera: between those of two cameras of a rig, or where a pose jumped,
/// there is no motion to go on with.
bool isMotion(const Eigen::Isometry3d& step, double max_depth_m) {
  constexpr double kMostTurn_rad = 0.35, kMostDepths = 0.25;
  return Eigen::AngleAxisd(step.linear()).angle() < kMostTurn_rad &&
         step.translation().norm() < kMostDepths * max_depth_m;
}

/// How far ahead blocks are read, and of which frames until there.
constexpr int kFramesAhead = 24, kFramesBetween = 3;

/// How often they are, beside behind frames for which blocks have moved.
constexpr uint64_t kFramesBetweenReads = 3;

/// From the middle block of a coarse cell to its corners, in voxels.
constexpr float kCellReach = 0.8661f * static_cast<float>((BlockCells::kSide + 1) * kBlockSide);

BlockKey middleOf(const BlockCells::Cell& cell) {
  constexpr int32_t kSide = BlockCells::kSide, kHalf = kSide / 2;
  return {cell.key.x * kSide + kHalf, cell.key.y * kSide + kHalf, cell.key.z * kSide + kHalf};
}

/// Depth of the middle of a block, in voxels.
float depthOf(const FrameView& view, const BlockKey& block) {
  constexpr float kHalf = 0.5f * static_cast<float>(kBlockSide);
  const Vec3f middle = toFloat(firstVoxelOfBlock(block - blockOfVoxel(view.origin_voxel))) +
                       Vec3f{kHalf, kHalf, kHalf};
  return rotateInverse(view.T_L_C, middle - view.T_L_C.t).z;
}

/// Whether one of a cell's outermost blocks is beyond a ball: no other one is farther away.
bool reachesBeyond(const BlockCells::Cell& cell, const KeptBall& kept) {
  constexpr int32_t kLast = BlockCells::kSide - 1;
  const BlockKey first{cell.key.x * BlockCells::kSide, cell.key.y * BlockCells::kSide,
                       cell.key.z * BlockCells::kSide};
  for (int32_t i = 0; i < 8; ++i) {
    const BlockKey corner = first + Vec3i{kLast * (i & 1), kLast * (i >> 1 & 1), kLast * (i >> 2)};
    if (squaredDistance(corner, kept.center) > kept.radius * kept.radius) return true;
  }
  return false;
}

/// Whether a voxel of a cell's blocks may lie in a region in units of voxels.
bool mayReachInto(const RegionView& region, const BlockCells::Cell& cell) {
  constexpr int kVoxels = BlockCells::kSide * kBlockSide;
  constexpr double kMiddle = 0.5 * (kVoxels - 1), kReach = 1.7321 * kMiddle + 0.1;
  const Vec3i& key = cell.key;
  return isInside(region,
                  Vec3d{static_cast<double>(key.x) * kVoxels + kMiddle,
                        static_cast<double>(key.y) * kVoxels + kMiddle,
                        static_cast<double>(key.z) * kVoxels + kMiddle},
                  kReach);
}

}  // namespace

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
      [&](const BlockCells::Cell& cell) { return mayReachInto(region, cell); },
      [&](int32_t number) { return mayBeInside(region, blocks_.block(number).block.key); });
}

std::vector<PackedKey> Pager::keysBeyond(const KeptBall& kept) const {
  const double limit = kept.radius * kept.radius;
  return blocks_.keysWhere([&](const BlockCells::Cell& cell) { return reachesBeyond(cell, kept); },
                           [&](int32_t number) {
                             return squaredDistance(blocks_.block(number).block.key, kept.center) >
                                    limit;
                           });
}

void Pager::noteFrame(const DepthFrame& frame, const FrameView& view, bool has_moved_blocks) {
  ++now_;
  const BlockKey origin = blockOfVoxel(view.origin_voxel);
  table_.visitCellsInView(view, kFootRadius, [&](const BlockCells::Cell& cell) {
    const auto seen = std::find_if(cell.slots.begin(), cell.slots.end(), [&](int32_t slot) {
      return mayBeInView(view, table_.block(slot).key - origin);
    });
    if (seen != cell.slots.end()) table_.noteNeed(table_.block(*seen).key, now_);
  });
  const bool is_time = has_moved_blocks || ++frames_ % kFramesBetweenReads == 0;
  if (is_time && T_W_C_before_) {
    const Eigen::Isometry3d motion = T_W_C_before_->inverse() * frame.T_W_C;
    ahead_of_ = {frame, std::nullopt};
    if (isMotion(motion, params_.fusion.max_depth_m)) ahead_of_->motion = motion;
  }
  T_W_C_before_ = frame.T_W_C;
}

/// Blocks on disk around what the camera comes to see if it moves on as it did, by coarse cells:
/// what comes first first, some more than are worth asking for. Those around it in memory stay.
std::vector<PackedKey> Pager::keysAhead(const SeenFrame& seen) {
  const size_t most =
      spareBytes(table_.budgetBytes()) / (BlockTable::kBlockBytes + BlockTable::kArrayBytes);
  std::vector<PackedKey> keys;
  std::unordered_set<PackedKey> known;
  DepthFrame ahead = seen.frame;
  for (int step = 0; step <= kFramesAhead && keys.size() < most; ++step) {
    if (step > 0 && seen.motion) ahead.T_W_C = ahead.T_W_C * *seen.motion;
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
    if (!seen.motion) break;
  }
  return keys;
}

/// What is read is often in the memory of the system already; where it is not, it is read while
/// other frames go on.
void Pager::moveBetween(MapBackend& backend) {
  if (const auto seen = std::exchange(ahead_of_, std::nullopt); seen && !isEmpty()) {
    ahead_ = keysAhead(*seen);
    for (const int32_t number : numbersOf(ahead_)) blocks_.readAhead(number);
    next_ahead_ = 0;
    ahead_at_once_ =
        seen->motion ? (ahead_.size() + kFramesBetweenReads - 1) / kFramesBetweenReads : 0;
    kept_since_ = std::exchange(ahead_now_, now_);
  }
  const size_t spare = spareBytes(table_.budgetBytes());
  if (!hasRoom(spare))
    evict(backend, spare, Reserve::kLeave, kept_since_ == 0 ? now_ : kept_since_);
  const size_t end = std::min(ahead_.size(), next_ahead_ + ahead_at_once_);
  if (next_ahead_ == end) return;
  const auto at = [this](size_t i) { return ahead_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::vector<int32_t> numbers = numbersOf({at(next_ahead_), at(end)});
  next_ahead_ = end;
  size_t bytes = 0;
  for (const int32_t number : numbers) bytes += bytesOf(blocks_.keyOf(number));
  if (!numbers.empty() && hasRoom(bytes)) readBatch(backend, std::move(numbers));
}

}  // namespace dtsdf
