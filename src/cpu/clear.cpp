#include "cpu/clear.h"

#include <algorithm>
#include <optional>

#include "cpu/voxel_row.h"
#include "cpu/widest_vectors.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {
namespace {

constexpr int kRows = kBlockSide * kBlockSide;

/// The distances in a voxel array, and for each voxel 1 if it has a distance, otherwise 0. A border
/// of voxels without a distance surrounds the array.
class DistanceGrid {
 public:
  void take(const Voxel* voxels) {
    const LaneInts nothing(0), one = bitsOf(LaneFloats(1.0f));
    for (int row = 0; row < kRows; ++row) {
      const VoxelRow of_row(voxels + row * kBlockSide);
      of_row.sdf().store(sdf_ + startOf(row));
      floatsOf((of_row.weightUnits() != nothing) & one).store(known_ + startOf(row));
    }
  }

  /// Slopes along an axis, for the voxels of a row.
  LaneFloats slopes(int row, int axis) const {
    const int at = startOf(row), step = axis == 0 ? 1 : (axis == 1 ? kSide : kSide * kSide);
    return slopeBeside(LaneFloats::load(sdf_ + at), LaneFloats::load(sdf_ + at + step),
                       LaneFloats::load(known_ + at + step), LaneFloats::load(sdf_ + at - step),
                       LaneFloats::load(known_ + at - step));
  }

 private:
  static constexpr int kSide = kBlockSide + 2;
  static int startOf(int row) {
    return 1 + kSide * (row % kBlockSide + 1 + kSide * (row / kBlockSide + 1));
  }

  float sdf_[kSide * kSide * kSide] = {}, known_[kSide * kSide * kSide] = {};
};

/// Checks which voxels of an array the frame contradicts, a row at a time, in loops that compilers
/// vectorise. The results equal those of judge() in free_space.h.
class RowJudge {
 public:
  // cppcheck-suppress uninitMemberVar  ; set for each row
  RowJudge(const FrameSensing& sensing, const Facing& facing, const Vec3f& first_voxel_L,
           bool in_turn, const FusionRules& rules, const std::optional<DistanceGrid>& distances)
      : sensing_(sensing),
        facing_(facing),
        first_voxel_L_(first_voxel_L),
        in_turn_(in_turn),
        rules_(rules),
        distances_(distances) {}

  /// Calls visit(index, is_covered, observation) for the contradicted voxels of a row.
  template <class Visit>
  void judge(const Voxel* voxels, int row, uint32_t covered, const Visit& visit) {
    const VoxelRow of_row(voxels + row * kBlockSide);
    const LaneInts is_covered = maskOf(covered);
    if (!findJudged(of_row, is_covered)) return;
    findOrigins(of_row, row, is_covered);
    if (in_turn_) moveToFeet(of_row, row, is_covered);
    findPixels();
    if (!findLookedThrough()) return;
    for (int x = 0; x < kBlockSide; ++x) {
      if (through_[x] == 0) continue;
      const Voxel& voxel = voxels[row * kBlockSide + x];
      const Observation observation = judgeFree(sensing_, voxel, {depth_m_[x], u_[x], v_[x]});
      if (!contradicts(observation, voxel, covered_[x] != 0, rules_)) continue;
      visit(row * kBlockSide + x, covered_[x] != 0, observation);
    }
  }

 private:
  /// Finds the voxels of the row to check. @return whether there are any.
  bool findJudged(const VoxelRow& voxels, const LaneInts& covered) {
    const LaneInts nothing(0);
    const LaneInts is_empty = voxels.weightUnits() == nothing;
    const LaneInts in_turn(in_turn_ ? -1 : 0);
    const LaneInts may_lose = in_turn & (voxels.evidence() > LaneInts(-rules_.max_evidence));
    const LaneInts judged =
        canChange(covered, voxels.anchor != nothing, is_empty, may_lose, in_turn);
    judged.store(judged_);
    covered.store(covered_);
    is_empty.store(is_empty_);
    return any(judged);
  }

  /// Sets the place of each voxel, the point at which it is tested, to judgedOrigin(). Anchors only
  /// need to be unpacked for covered voxels.
  void findOrigins(const VoxelRow& voxels, int row, const LaneInts& covered) {
    const auto put = [&](int x, const Vec3f& origin) {
      place_x_[x] = origin.x;
      place_y_[x] = origin.y;
      place_z_[x] = origin.z;
    };
    const int first = row * kBlockSide;
    if (!any(covered)) {
      for (int x = 0; x < kBlockSide; ++x) put(x, toFloat(voxelOffset(first + x)));
      return;
    }
    int32_t anchor[kBlockSide];
    voxels.anchor.store(anchor);
    for (int x = 0; x < kBlockSide; ++x) {
      put(x, judgedOrigin(static_cast<uint16_t>(anchor[x]), first + x, covered_[x] != 0));
    }
  }

  /// Sets the place of each voxel that is neither covered nor empty to its foot (footOf()), the
  /// point at which the voxel's distance puts the surface.
  void moveToFeet(const VoxelRow& voxels, int row, const LaneInts& covered) {
    const LaneFloats judged_sdf = select(covered, LaneFloats(0.0f), voxels.sdf());
    if (!any(bitsOf(judged_sdf))) return;
    float sdf[kBlockSide], slope_x[kBlockSide], slope_y[kBlockSide], slope_z[kBlockSide];
    judged_sdf.store(sdf);
    distances_->slopes(row, 0).store(slope_x);
    distances_->slopes(row, 1).store(slope_y);
    distances_->slopes(row, 2).store(slope_z);
    for (int x = 0; x < kBlockSide; ++x) {
      const Vec3f foot = footOf({place_x_[x], place_y_[x], place_z_[x]}, sdf[x],
                                {slope_x[x], slope_y[x], slope_z[x]}, facing_);
      place_x_[x] = foot.x;
      place_y_[x] = foot.y;
      place_z_[x] = foot.z;
    }
  }

  void findPixels() {
    const FrameView& frame = sensing_.image.frame;
    for (int x = 0; x < kBlockSide; ++x) {
      const VoxelInImage at =
          projectToImage(frame, first_voxel_L_ + Vec3f{place_x_[x], place_y_[x], place_z_[x]});
      depth_m_[x] = at.depth_m;
      u_[x] = at.u;
      v_[x] = at.v;
      pixel_[x] = pixelOfPlace(frame, at);
      pixel_depth_m_[x] = requiredFreeDepth(frame, is_empty_[x] != 0, at);
    }
  }

  /// Finds the checked voxels whose places the image shows to be free. Reads only the pixel onto
  /// which each place projects. @return whether there are any.
  bool findLookedThrough() {
    LaneFloats free_m;
    for (int x = 0; x < kBlockSide; ++x) free_m.v[x] = sensing_.free_depth[pixel_[x]];
    const LaneInts through = LaneInts::load(judged_) & (free_m > LaneFloats::load(pixel_depth_m_));
    through.store(through_);
    return any(through);
  }

  const FrameSensing sensing_;  // copies, as stores may alias references
  const Facing facing_;
  const Vec3f first_voxel_L_;
  const bool in_turn_;
  const FusionRules rules_;
  const std::optional<DistanceGrid>& distances_;  ///< The array's distances, if in_turn_.
  int32_t covered_[kBlockSide], judged_[kBlockSide], is_empty_[kBlockSide];
  float place_x_[kBlockSide], place_y_[kBlockSide], place_z_[kBlockSide];
  float depth_m_[kBlockSide], u_[kBlockSide], v_[kBlockSide];
  int32_t pixel_[kBlockSide], through_[kBlockSide];
  float pixel_depth_m_[kBlockSide];
};

/// Finds the voxels of an array that lose evidence, and their new values. Does not change the array
/// yet, as the foot of a voxel depends on its neighbours. @return the number of voxels found.
int findContradicted(const BlockCheck& check, int direction, const FrameSensing& sensing,
                     const FusionRules& rules, const Voxel* voxels,
                     std::optional<DistanceGrid>& distances, int (&index)[kVoxelsPerBlock],
                     Voxel (&result)[kVoxelsPerBlock]) {
  const bool has_sums = check.sums != nullptr && (check.directions >> direction & 1);
  const Facing facing = facingOf(check.directional ? direction : kAnyDirection);
  int count = 0;
  withWidestVectors([&] {
    RowJudge judge(sensing, facing, toFloat(firstVoxelOfBlock(check.block_L)), check.in_turn, rules,
                   distances);
    if (distances) distances->take(voxels);
    uint64_t covered_rows = 0;  // the covered voxels of the layer's rows from `row` on
    for (int row = 0; row < kRows; ++row, covered_rows >>= kBlockSide) {
      if (row % kBlockSide == 0 && has_sums) {
        covered_rows = check.sums->covered[direction].word[row / kBlockSide];
      }
      const uint32_t covered = covered_rows & 255u;
      if (covered == 0 && !check.in_turn) continue;
      judge.judge(voxels, row, covered, [&](int i, bool is_covered, Observation observation) {
        const int32_t frames = contradictionWeight(observation, is_covered, rules);
        index[count] = i;
        result[count++] = contradictedVoxel(voxels[i], frames, is_covered, rules);
      });
    }
  });
  return count;
}

}  // namespace

ClearedBlock clearBlock(const BlockCheck& check, const BlockEntry& entry,
                        const FrameSensing& sensing, const FusionRules& rules, VoxelStore& voxels) {
  ClearedBlock result{false, 0, 0};
  std::optional<DistanceGrid> distances;  // only if needed, as it is large
  if (check.in_turn) distances.emplace();
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    const bool has_sums = check.sums != nullptr && (check.directions >> d & 1);
    if (!has_sums && !check.in_turn) continue;
    Voxel* array = voxels.array(entry.array[d]);
    int index[kVoxelsPerBlock];
    Voxel contradicted[kVoxelsPerBlock];
    const int count =
        findContradicted(check, d, sensing, rules, array, distances, index, contradicted);
    if (count == 0) continue;
    bool has_emptied = false;
    for (int i = 0; i < count; ++i) {
      Voxel& voxel = array[index[i]];
      const bool was_empty = isEmpty(voxel);
      voxel = contradicted[i];
      result.changed |= !was_empty;
      has_emptied |= !was_empty && isEmpty(voxel);
    }
    if (!has_emptied) continue;
    result.emptied_directions |= 1u << d;
    if (std::all_of(array, array + kVoxelsPerBlock, isEmpty)) result.empty_directions |= 1u << d;
  }
  return result;
}

}  // namespace dtsdf
