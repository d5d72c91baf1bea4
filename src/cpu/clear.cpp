#include "cpu/clear.h"

#include <algorithm>

#include "cpu/widest_vectors.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {
namespace {

/// A voxel that a frame contradicts, and what it sees there.
struct ContradictedVoxel {
  int index;
  bool is_covered;
  Sight sight;
};

/// Voxels of an array that a frame judges. Where their places are seen is found side by side, which
/// compilers turn into vector instructions, with the same bits as judge().
class JudgedBatch {
 public:
  bool isFull() const { return count_ == kVoxels; }

  void add(const Voxel* voxels, int index, bool is_covered) {
    const Voxel& voxel = voxels[index];
    const int i = count_++;
    index_[i] = index;
    anchor_[i] = voxel.anchor;
    is_covered_[i] = is_covered;
    is_empty_[i] = isEmpty(voxel);
    sdf_[i] = judgedSdf(voxel, is_covered);
    // Of no distance, as that of an empty voxel, the slope does not matter.
    const Vec3f slope = sdf_[i] == 0.0f ? Vec3f{0.0f, 0.0f, 0.0f} : slopeAt(voxels, index);
    slope_x_[i] = slope.x;
    slope_y_[i] = slope.y;
    slope_z_[i] = slope.z;
  }

  /// Appends those that are contradicted, and forgets all.
  void judgeInto(const FrameSensing& sensing, const Facing& facing, const Vec3f& first_voxel_L,
                 const FusionRules& rules, const Voxel* voxels, ContradictedVoxel* contradicted,
                 int& contradicted_count) {
    withWidestVectors([&] { findPixels(sensing.image.frame, facing, first_voxel_L); });
    for (int i = 0; i < count_; ++i) {
      if (!looksThrough(sensing, {pixel_[i], pixel_depth_m_[i]})) continue;
      const bool is_covered = is_covered_[i] != 0;
      const Voxel& voxel = voxels[index_[i]];
      const Sight sight = judgeFree(sensing, voxel, {depth_m_[i], u_[i], v_[i]});
      if (!isAgainst(sight, voxel, is_covered, rules)) continue;
      contradicted[contradicted_count++] = {index_[i], is_covered, sight};
    }
    count_ = 0;
  }

 private:
  static constexpr int kVoxels = 64, kTogether = 8;

  /// Also at places up to a multiple of `kTogether`, which hold older voxels.
  void findPixels(const FrameView& view, const Facing& facing, const Vec3f& first_voxel_L) {
    const FrameView frame = view;  // a copy of its own, which no result can overlap
    const int count = (count_ + kTogether - 1) / kTogether * kTogether;
    for (int i = 0; i < count; ++i) {
      const Vec3f origin =
          judgedOrigin(static_cast<uint16_t>(anchor_[i]), index_[i], is_covered_[i] != 0);
      const Vec3f place = footOf(origin, sdf_[i], {slope_x_[i], slope_y_[i], slope_z_[i]}, facing);
      const VoxelInImage at = projectToImage(frame, first_voxel_L + place);
      depth_m_[i] = at.depth_m;
      u_[i] = at.u;
      v_[i] = at.v;
      const JudgingPixel pixel = judgingPixel(frame, is_empty_[i] != 0, at);
      pixel_[i] = pixel.index;
      pixel_depth_m_[i] = pixel.depth_m;
    }
  }

  int count_ = 0;
  int32_t index_[kVoxels] = {}, anchor_[kVoxels] = {};
  int32_t is_covered_[kVoxels] = {}, is_empty_[kVoxels] = {};
  float sdf_[kVoxels] = {};
  float slope_x_[kVoxels] = {}, slope_y_[kVoxels] = {}, slope_z_[kVoxels] = {};
  float depth_m_[kVoxels], u_[kVoxels], v_[kVoxels];
  int32_t pixel_[kVoxels];
  float pixel_depth_m_[kVoxels];
};

Look lookOf(const BlockLook& look, const FrameSensing& sensing) {
  if (!look.in_turn) return {false, 0};
  return {true, octantsSeenThrough(sensing, toFloat(firstVoxelOfBlock(look.block_L)))};
}

/// Calls visit(index, is covered) for the voxels that a frame judges which covers these, if any.
template <class Visit>
void visitJudged(const Voxel* voxels, const VoxelSet* covered, const Look& look,
                 const FusionRules& rules, const Visit& visit) {
  const auto consider = [&](int i, bool is_covered) {
    if (isJudged(voxels[i], i, is_covered, look, rules)) visit(i, is_covered);
  };
  if (!look.in_turn) {  // and so nothing else
    covered->forEach([&](int i) { consider(i, true); });
    return;
  }
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    consider(i, covered != nullptr && covered->contains(i));
  }
}

/// All voxels are judged before the first one changes: they look at their neighbours.
/// @return the number of voxels that are contradicted.
int findContradicted(const BlockLook& look, const Look& rule, int direction,
                     const FrameSensing& sensing, const FusionRules& rules, const Voxel* voxels,
                     ContradictedVoxel (&found)[kVoxelsPerBlock]) {
  const bool has_sums = look.sums != nullptr && (look.directions >> direction & 1);
  const Facing facing = facingOf(look.directional ? direction : kAnyDirection);
  const Vec3f first_voxel_L = toFloat(firstVoxelOfBlock(look.block_L));
  JudgedBatch batch;
  int count = 0;
  const auto judgeBatch = [&] {
    batch.judgeInto(sensing, facing, first_voxel_L, rules, voxels, found, count);
  };
  visitJudged(voxels, has_sums ? &look.sums->covered[direction] : nullptr, rule, rules,
              [&](int i, bool is_covered) {
                batch.add(voxels, i, is_covered);
                if (batch.isFull()) judgeBatch();
              });
  judgeBatch();
  return count;
}

}  // namespace

ClearedBlock clearBlock(const BlockLook& look, const BlockEntry& entry, const FrameSensing& sensing,
                        const FusionRules& rules, VoxelStore& voxels) {
  ClearedBlock result{false, 0};
  const Look rule = lookOf(look, sensing);
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    const bool has_sums = look.sums != nullptr && (look.directions >> d & 1);
    if (!has_sums && !look.in_turn) continue;
    Voxel* array = voxels.array(entry.array[d]);
    ContradictedVoxel found[kVoxelsPerBlock];
    const int count = findContradicted(look, rule, d, sensing, rules, array, found);
    if (count == 0) continue;
    bool has_emptied = false;
    for (int i = 0; i < count; ++i) {
      Voxel& voxel = array[found[i].index];
      const bool was_empty = isEmpty(voxel);
      const int32_t frames = framesAgainst(found[i].sight, found[i].is_covered, rules);
      voxel = contradictedVoxel(voxel, frames, found[i].is_covered, rules);
      result.changed |= !was_empty;
      has_emptied |= !was_empty && isEmpty(voxel);
    }
    if (has_emptied && std::all_of(array, array + kVoxelsPerBlock, isEmpty)) {
      result.empty_directions |= 1u << d;
    }
  }
  return result;
}

}  // namespace dtsdf
