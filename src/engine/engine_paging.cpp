// Which blocks the engine needs in memory, and when: what a depth image changes, what a colour
// image or a view looks at, what meshes depend on. Where blocks go and come from is the pager's.
#include <algorithm>
#include <stdexcept>
#include <unordered_set>
#include <utility>

#include "backend/rule_settings.h"
#include "engine/engine.h"
#include "kernels/colour/surface_point.h"
#include "kernels/fusion/free_space.h"
#include "kernels/render/drawn_triangle.h"

namespace dtsdf {
namespace {

/// Between two images of one camera: between those of two cameras of a rig, or where a pose jumped,
/// there is no motion to go on with.
bool isMotion(const Eigen::Isometry3d& step, double max_depth_m) {
  constexpr double kMostTurn_rad = 0.35, kMostDepths = 0.25;
  return Eigen::AngleAxisd(step.linear()).angle() < kMostTurn_rad &&
         step.translation().norm() < kMostDepths * max_depth_m;
}

/// From the middle of a block to a view that depends on it: voxels up to one block farther than
/// the units whose labels do.
constexpr float kViewRadius = kLabelledReach + 13.9f;
constexpr float kAnyDepth_m = 1e30f;

/// How far ahead blocks are read, and of which frames until there.
constexpr int kFramesAhead = 24, kFramesBetween = 3;

/// How often they are, beside behind frames for which blocks have moved.
constexpr uint64_t kFramesBetweenReads = 3;

/// Frames without an extraction of which it is known what they have changed.
constexpr size_t kMostViews = 8;

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
template <class IsBeyond>
bool reachesBeyond(const BlockCells::Cell& cell, const IsBeyond& is_beyond) {
  constexpr int32_t kLast = BlockCells::kSide - 1;
  const BlockKey first{cell.key.x * BlockCells::kSide, cell.key.y * BlockCells::kSide,
                       cell.key.z * BlockCells::kSide};
  for (int32_t i = 0; i < 8; ++i) {
    if (is_beyond(first + Vec3i{kLast * (i & 1), kLast * (i >> 1 & 1), kLast * (i >> 2)})) {
      return true;
    }
  }
  return false;
}

}  // namespace

/// Blocks that a depth image touches, and those that it may clear, of all that there are: they are
/// in memory then. Where these are too many at once, they come part by part, and the image is fused
/// into all parts but for the last, which is left to the caller.
/// @return how many blocks stay on disk or are refused, as there is no room for them.
size_t Engine::bringInForFrame(const FrameView& view, const TouchedCounts& touched,
                               std::vector<int32_t>& in_view) {
  const StageTimer timer(profile_, Stage::kAdmit);
  requests_ = backend_->requests();
  if (views_.size() == kMostViews) forgetWhatIsMarked();
  if (views_.size() < kMostViews) views_.push_back(view);
  part_.clear();
  moves_blocks_ = !hasAllOf(view) || !pager_->hasRoom(touched.requests * BlockTable::kBlockBytes +
                                                      touched.new_arrays * BlockTable::kArrayBytes);
  if (!moves_blocks_) return 0;
  std::sort(requests_.begin(), requests_.end(),
            [](const BlockRequest& a, const BlockRequest& b) { return a.key < b.key; });
  const size_t most_bytes = table_.budgetBytes() - table_.budgetBytes() / 8;
  size_t left = 0, bytes = 0, new_bytes = 0, next_request = 0;
  const std::vector<PackedKey> keys = keysOfFrame(view, in_view);
  const bool fits_anyway = mostBytes(keys.size()) <= most_bytes;  // so that none is looked up
  std::vector<PackedKey> part;
  for (const PackedKey key : keys) {
    const size_t wanted = bytesWanted(key, next_request);
    const size_t had = fits_anyway ? 0 : pager_->bytesOf(key);
    if (!part.empty() && bytes + had + wanted > most_bytes) {
      part_.swap(part);
      left += bringInPart(new_bytes);
      left += fusePart(view, touched);
      part.clear();
      bytes = new_bytes = 0;
    }
    part.push_back(key);
    bytes += had + wanted;
    new_bytes += wanted;
  }
  const bool is_whole = part.size() == keys.size();
  part_.swap(part);
  left += bringInPart(new_bytes);
  if (is_whole) part_.clear();
  in_view = blocksOfPart(view);
  return left;
}

/// Whether no block on disk is one that a depth image touches or may clear.
bool Engine::hasAllOf(const FrameView& view) {
  if (pager_->isEmpty()) return true;
  const auto is_paged = [this](const BlockRequest& request) {
    return pager_->isPaged(request.key);
  };
  if (std::any_of(requests_.begin(), requests_.end(), is_paged)) return false;
  if (!clearsFreeSpace(params_)) return true;
  const std::vector<PackedKey> others = pagedInView(view, kFootRadius);
  return others.empty() || backend_->mover()->seenThrough(others, counters_.frames + 1).empty();
}

/// Blocks on disk that a frame may see, and others around.
std::vector<PackedKey> Engine::pagedInView(const FrameView& view, float radius) const {
  return pager_->keysInView(view, radius, [](const BlockCells::Cell&) { return true; });
}

/// Of so many blocks, whatever they hold.
size_t Engine::mostBytes(size_t blocks) const {
  constexpr size_t kBricks = kDirectionCount * kBricksPerArray;
  return blocks * (BlockTable::kBlockBytes + kDirectionCount * BlockTable::kArrayBytes +
                   (has_colours_ ? kBricks * BlockTable::kColourBytes : 0));
}

/// By key, each once.
std::vector<PackedKey> Engine::keysOfFrame(const FrameView& view,
                                           const std::vector<int32_t>& in_view) {
  std::vector<PackedKey> keys = backend_->mover()->touchedKeys();
  if (clearsFreeSpace(params_)) {
    std::vector<PackedKey> others = pagedInView(view, kFootRadius);
    for (const int32_t slot : in_view) {
      if (table_.block(slot).in_use) others.push_back(packKey(table_.block(slot).key));
    }
    const std::vector<PackedKey> seen =
        backend_->mover()->seenThrough(others, counters_.frames + 1);
    keys.insert(keys.end(), seen.begin(), seen.end());
  }
  keepEachOnce(keys);
  return keys;
}

/// Bytes that a block wants beyond those that it has, which one without arrays may lose until it is
/// admitted; keys are asked for in their order.
size_t Engine::bytesWanted(PackedKey key, size_t& next_request) const {
  while (next_request < requests_.size() && requests_[next_request].key < key) ++next_request;
  if (next_request == requests_.size() || requests_[next_request].key != key) return 0;
  const uint32_t known = pager_->directionsOf(key);
  const int arrays = __builtin_popcount(requests_[next_request].directions & ~known);
  return static_cast<size_t>(arrays) * BlockTable::kArrayBytes +
         (known == 0 ? BlockTable::kBlockBytes : 0);
}

size_t Engine::bringInPart(size_t new_bytes) {
  const size_t left = pager_->bringIn(*backend_, part_, new_bytes);
  counters_.refused += left;
  return left;
}

/// As fuse() goes on, and settle() after it: slots are others in the next part.
/// @return the number of blocks refused.
size_t Engine::fusePart(const FrameView& view, const TouchedCounts& touched) {
  const std::vector<int32_t> in_view = blocksOfPart(view);
  const FrameTurn turn{counters_.frames + 1, in_view, &part_};
  const size_t refused = admit(touched, turn);
  backend_->castFoldAndClear(turn);
  std::vector<int32_t> changed = vacateEmpty();
  releaseUnseen();
  keepEachOnce(changed);
  backend_->follow({changed, false});
  return refused;
}

/// Blocks that are left on disk are none to be made anew.
std::vector<BlockRequest> Engine::requestsOfPart() {
  if (!moves_blocks_) return std::move(requests_);
  std::vector<BlockRequest> requests;
  for (const BlockRequest& request : requests_) {
    const bool is_in_part =
        part_.empty() || std::binary_search(part_.begin(), part_.end(), request.key);
    if (is_in_part && !pager_->isPaged(request.key)) requests.push_back(request);
  }
  return requests;
}

/// Blocks of which an image sees something, or that hide something from it.
/// @return how many of them stay on disk.
size_t Engine::bringInForImage(const FrameView& view, std::vector<int32_t>& in_view) {
  const StageTimer timer(profile_, Stage::kPaint);
  const float radius = pointRadius(rules_.colour);
  const size_t left =
      pager_->bringIn(*backend_, keysInView(view, radius, paint_settings_.max_depth_m), 0);
  counters_.refused += left;
  in_view = table_.slotsInView(view, radius);
  return left;
}

/// Blocks on disk around what the camera comes to see if it moves on as it did, by coarse cells:
/// what comes first first, some more than are worth asking for. Those around it in memory stay.
std::vector<PackedKey> Engine::keysAhead(const DepthFrame& frame, const Eigen::Isometry3d& motion) {
  std::vector<PackedKey> keys;
  std::unordered_set<PackedKey> known;
  DepthFrame ahead = frame;
  for (int step = 0; step <= kFramesAhead && keys.size() < pager_->mostAhead(); ++step) {
    if (step > 0) ahead.T_W_C = ahead.T_W_C * motion;
    if (step % kFramesBetween != 0 || findProblem(ahead, params_)) continue;
    const FrameView view = makeFrameView(ahead, params_.map.voxel_size_m);
    pager_->noteAhead(view, kMeshedRadius);
    const float max_depth = params_.fusion.max_depth_m / view.voxel_size_m + kMeshedRadius;
    const std::vector<PackedKey> some =
        pager_->keysInView(view, kMeshedRadius, [&](const BlockCells::Cell& cell) {
          return depthOf(view, middleOf(cell)) <= max_depth + kCellReach &&
                 known.insert(packKey(cell.key)).second;
        });
    keys.insert(keys.end(), some.begin(), some.end());
  }
  return keys;
}

/// What comes next is looked for between frames, or before the next one: see moveAhead().
void Engine::noteForReading(const DepthFrame& frame, const FrameView& view) {
  pager_->noteView(view);
  const bool is_time = moves_blocks_ || counters_.frames % kFramesBetweenReads == 0;
  if (is_time && T_W_C_before_) {
    ahead_of_ = {frame, T_W_C_before_->inverse() * frame.T_W_C};
  }
  T_W_C_before_ = frame.T_W_C;
}

/// What is read is often in the memory of the system already; where it is not, the frame that needs
/// it finds it read.
void Engine::moveAhead() {
  if (const auto last = std::exchange(ahead_of_, std::nullopt); last && !pager_->isEmpty()) {
    const bool is_motion = isMotion(last->motion, params_.fusion.max_depth_m);
    const Eigen::Isometry3d motion = is_motion ? last->motion : Eigen::Isometry3d::Identity();
    pager_->readAhead(*backend_, keysAhead(last->frame, motion),
                      is_motion ? kFramesBetweenReads : 0);
  }
  pager_->moveAhead(*backend_);
}

/// Between this frame and the next one. Where a device lacks the memory, blocks move once they have
/// to.
void Engine::moveBeside() {
  moved_ahead_ = true;
  helper_.start([this] {
    try {
      made();
      moveAhead();
    } catch (const BackendError& error) {
      if (!error.lacksMemory()) throw;
    }
  });
}

/// @throws std::runtime_error where they do not fit into memory.
void Engine::bringInForView(const FrameView& view) {
  if (pager_->isEmpty()) return;
  if (pager_->bringIn(*backend_, keysInView(view, kViewRadius, kAnyDepth_m), 0) == 0) return;
  throw std::runtime_error(
      "the view shows more of the map than fits into memory; raise "
      "map/max_memory_mb, or render the saved map");
}

AlignmentSums Engine::sumsAt(const FrameView& view, float cutoff) {
  if (pager_ && !pager_->isEmpty()) {
    pager_->bringIn(*backend_, backend_->mover()->alignedKeys(view, cutoff), 0);
  }
  return backend_->sumsAt(view, cutoff);
}

/// Blocks in memory and on disk, the nearest first.
std::vector<PackedKey> Engine::keysInView(const FrameView& view, float radius,
                                          float max_depth_m) const {
  const float max_depth = max_depth_m / view.voxel_size_m + radius;
  const BlockKey origin = blockOfVoxel(view.origin_voxel);
  const auto is_in_view = [&](const BlockKey& block) {
    return mayBeInView(view, block - origin, radius) && depthOf(view, block) <= max_depth;
  };
  std::vector<PackedKey> keys;
  for (const PackedKey key : pagedInView(view, radius)) {
    if (is_in_view(unpackKey(key))) keys.push_back(key);
  }
  for (const int32_t slot : table_.slotsInView(view, radius)) {
    const BlockKey& key = table_.block(slot).key;
    if (is_in_view(key)) keys.push_back(packKey(key));
  }
  std::vector<std::pair<float, PackedKey>> by_depth;
  by_depth.reserve(keys.size());
  for (const PackedKey key : keys) by_depth.push_back({depthOf(view, unpackKey(key)), key});
  std::sort(by_depth.begin(), by_depth.end());
  for (size_t i = 0; i < keys.size(); ++i) keys[i] = by_depth[i].second;
  return keys;
}

/// Of all blocks beyond what is kept, the farthest ones go, wherever they are: those in memory are
/// left in the list. @return those on disk.
std::vector<PackedKey> Engine::takeFarthest(const KeptBall& kept,
                                            std::vector<int32_t>& slots) const {
  struct Beyond {
    double distance;
    PackedKey key;
    int32_t slot;  ///< -1: on disk.
  };
  std::vector<Beyond> all;
  for (const int32_t slot : slots) {
    const BlockKey& key = table_.block(slot).key;
    all.push_back({squaredDistance(key, kept.center), packKey(key), slot});
  }
  const double limit = kept.radius * kept.radius;
  const auto is_beyond = [&](const BlockKey& key) {
    return squaredDistance(key, kept.center) > limit;
  };
  const auto reaches_beyond = [&](const BlockCells::Cell& cell) {
    return reachesBeyond(cell, is_beyond);
  };
  for (const PackedKey key : pager_->keysWhere(reaches_beyond, is_beyond)) {
    all.push_back({squaredDistance(unpackKey(key), kept.center), key, -1});
  }
  std::sort(all.begin(), all.end(), [](const Beyond& a, const Beyond& b) {
    return a.distance != b.distance ? a.distance > b.distance : a.key < b.key;
  });
  if (all.size() > kMostDroppedBlocks) all.resize(kMostDroppedBlocks);
  slots.clear();
  std::vector<PackedKey> on_disk;
  for (const Beyond& block : all) {
    if (block.slot < 0) {
      on_disk.push_back(block.key);
    } else {
      slots.push_back(block.slot);
    }
  }
  return on_disk;
}

}  // namespace dtsdf
