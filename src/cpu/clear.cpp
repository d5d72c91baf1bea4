#include "cpu/clear.h"

#include <algorithm>

#include "cpu/widest_vectors.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {
namespace {

/// Voxels that are judged at once, at most.
constexpr int kBatch = 64;

/// A voxel that a frame judges, and what it sees there.
struct JudgedVoxel {
  int index;
  bool is_covered;
  Sight sight;
};

/// The places of some of an array's voxels, found side by side: judge()'s way to where a place
/// is seen, which compilers turn into vector instructions. Same bits.
class PlaceBatch {
 public:
  VoxelInImage at(int i) const { return {depth_m_[i], u_[i], v_[i]}; }

  void compute(const Voxel* voxels, const JudgedVoxel* judged, int count, const Facing& facing,
               const Vec3f& first_voxel_L, const FrameView& view) {
    for (int i = 0; i < count; ++i) gather(voxels, judged[i], i);
    withWidestVectors([&] { project(count, facing, first_voxel_L, view); });
  }

 private:
  void project(int count, const Facing& facing, const Vec3f& first_voxel_L,
               const FrameView& view) {
    const FrameView frame = view;  // a copy of its own, which no result can overlap
    for (int i = 0; i < count; ++i) {
      const Vec3f place =
          footOf({x_[i], y_[i], z_[i]}, sdf_[i], {slope_x_[i], slope_y_[i], slope_z_[i]}, facing);
      const VoxelInImage at = projectToImage(frame, first_voxel_L + place);
      depth_m_[i] = at.depth_m;
      u_[i] = at.u;
      v_[i] = at.v;
    }
  }

  void gather(const Voxel* voxels, const JudgedVoxel& judged, int i) {
    const JudgedPlace place = judgedPlace(voxels[judged.index], judged.index, judged.is_covered);
    // Of no distance, as that of an empty voxel, the slope does not matter.
    const Vec3f slope =
        place.sdf == 0.0f ? Vec3f{0.0f, 0.0f, 0.0f} : slopeAt(voxels, judged.index);
    x_[i] = place.origin.x;
    y_[i] = place.origin.y;
    z_[i] = place.origin.z;
    sdf_[i] = place.sdf;
    slope_x_[i] = slope.x;
    slope_y_[i] = slope.y;
    slope_z_[i] = slope.z;
  }

  float x_[kBatch], y_[kBatch], z_[kBatch], sdf_[kBatch];
  float slope_x_[kBatch], slope_y_[kBatch], slope_z_[kBatch];
  float depth_m_[kBatch], u_[kBatch], v_[kBatch];
};

Look lookOf(const BlockLook& look, const FrameSensing& sensing) {
  if (!look.in_turn) return {false, 0};
  return {true, octantsSeenThrough(sensing, toFloat(firstVoxelOfBlock(look.block_L)))};
}

/// Lists the voxels that a frame judges that covers these, if any. @return their number.
int findJudged(const Voxel* voxels, const VoxelSet* covered, const Look& look,
               const FusionRules& rules, JudgedVoxel (&found)[kVoxelsPerBlock]) {
  int count = 0;
  const auto consider = [&](int i, bool is_covered) {
    found[count] = {i, is_covered, Sight::kSurface};
    count += static_cast<int>(isJudged(voxels[i], i, is_covered, look, rules));
  };
  if (!look.in_turn) {  // and so nothing else
    covered->forEach([&](int i) { consider(i, true); });
    return count;
  }
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    consider(i, covered != nullptr && covered->contains(i));
  }
  return count;
}

/// All voxels are judged before the first one changes: they look at their neighbours.
/// @return the number of voxels that are contradicted.
int findContradicted(const BlockLook& look, const Look& rule, int direction,
                     const FrameSensing& sensing, const FusionRules& rules, const Voxel* voxels,
                     JudgedVoxel (&found)[kVoxelsPerBlock]) {
  const bool has_sums = look.sums != nullptr && (look.directions >> direction & 1);
  const int judged = findJudged(voxels, has_sums ? &look.sums->covered[direction] : nullptr,
                                rule, rules, found);
  const Facing facing = facingOf(look.directional ? direction : kAnyDirection);
  const Vec3f first_voxel_L = toFloat(firstVoxelOfBlock(look.block_L));
  PlaceBatch places;
  int count = 0;
  for (int first = 0; first < judged; first += kBatch) {
    const int batch = std::min(kBatch, judged - first);
    places.compute(voxels, found + first, batch, facing, first_voxel_L, sensing.image.frame);
    for (int i = 0; i < batch; ++i) {
      JudgedVoxel voxel = found[first + i];
      voxel.sight = judge(sensing, voxels[voxel.index], places.at(i));
      if (isAgainst(voxel.sight, voxel.is_covered)) found[count++] = voxel;
    }
  }
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
    JudgedVoxel found[kVoxelsPerBlock];
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
