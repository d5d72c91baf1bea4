#include "cpu/ray_units.h"

#include <cstring>

#include "cpu/widest_vectors.h"

namespace dtsdf {
namespace {

constexpr int kLastInBlock = kBlockSide - 1;

/// Samples of a unit that were fetched.
struct FetchedSamples {
  using Real = float;
  using Bits = int32_t;
  static constexpr int kUnits = 1;

  float sdfs[kDirectionCount][kCubeCorners], weights[kDirectionCount][kCubeCorners];
  uint32_t observed = 0, two_sided = 0;  ///< Directions, a bit each.

  float sdf(int direction, int c) const { return sdfs[direction][c]; }
  float weight(int direction, int c) const { return weights[direction][c]; }
  bool isObserved(int direction) const { return (observed >> direction & 1) != 0; }
  bool maySpeak(int direction) const { return (two_sided >> direction & 1) != 0; }
};

int placeInBlock(const Vec3i& unit) {
  return voxelIndex(unit.x & kLastInBlock, unit.y & kLastInBlock, unit.z & kLastInBlock);
}

/// Where a unit's corners are: which of a RayBlock's blocks, and which of its voxels.
struct UnitCorners {
  int block[kCubeCorners], voxel[kCubeCorners];
};

UnitCorners cornersOf(const Vec3i& unit) {
  // From the last voxel of a row, the next one is the first of another block's.
  const auto leaves = [](int32_t at) { return (at & kLastInBlock) == kLastInBlock; };
  const auto stride = [&](int32_t at, int voxels) {
    return leaves(at) ? -kLastInBlock * voxels : voxels;
  };
  const int other = static_cast<int>(leaves(unit.x)) | static_cast<int>(leaves(unit.y)) << 1 |
                    static_cast<int>(leaves(unit.z)) << 2;
  const int x = stride(unit.x, 1), y = stride(unit.y, kBlockSide);
  const int z = stride(unit.z, kBlockSide * kBlockSide), first = placeInBlock(unit);
  UnitCorners corners;
  for (int c = 0; c < kCubeCorners; ++c) {
    corners.block[c] = c & other;
    corners.voxel[c] = first + (c & 1) * x + (c >> 1 & 1) * y + (c >> 2) * z;
  }
  return corners;
}

void fetchDirection(const RayBlock& block, const UnitCorners& corners, int d,
                    int32_t least_evidence, FetchedSamples& samples) {
  uint64_t voxels[kCubeCorners];
  static_assert(sizeof(voxels[0]) == sizeof(Voxel), "");
  for (int c = 0; c < kCubeCorners; ++c) {
    std::memcpy(&voxels[c], &block.voxels[corners.block[c]][d][corners.voxel[c]], sizeof(Voxel));
  }
  int32_t in_front = 0, behind = 0;
  for (int c = 0; c < kCubeCorners; ++c) {
    Voxel voxel;
    std::memcpy(&voxel, &voxels[c], sizeof(voxel));
    const Sample sample = sampleOf(voxel, least_evidence);
    samples.sdfs[d][c] = sample.sdf;
    samples.weights[d][c] = sample.weight;
    const auto known = static_cast<int32_t>(sample.weight > 0.0f);
    in_front |= known & static_cast<int32_t>(sample.sdf >= -kTouching);
    behind |= known & static_cast<int32_t>(sample.sdf < kTouching);
  }
  samples.observed |= 1u << d;
  samples.two_sided |= static_cast<uint32_t>(in_front & behind) << d;
}

RayUnit makeUnit(const RayScene& scene, const RayBlock& block, const Vec3i& unit) {
  RayUnit made;
  withWidestVectors([&] {
    FetchedSamples samples;
    const UnitCorners corners = cornersOf(unit);
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!has(block.units.seen[d], unit)) continue;
      fetchDirection(block, corners, d, scene.least_evidence, samples);
    }
    const Vec3f middle = toFloat(unit) + Vec3f{0.5f, 0.5f, 0.5f};
    made = makeRayUnit(kMeshTables, scene.rules, samples, scene.directional,
                       middle - scene.frame.T_L_C.t);
  });
  return made;
}

ColouredSample colouredAt(const RayScene& scene, const BlockEntry* entry, int voxel,
                          int direction) {
  const int32_t array = entry == nullptr ? kNoArray : entry->array[direction];
  if (array == kNoArray) return {{0.0f, 0.0f}, {0, 0, 0, 0}};
  const Sample sample = sampleOf(scene.map.voxels.array(array)[voxel], scene.least_evidence);
  const int32_t number = scene.map.table.colourOf(array, brickOf(voxel));
  if (number == kNoArray) return {sample, {0, 0, 0, 0}};
  return {sample, scene.map.colours.array(number)[placeInBrick(voxel)]};
}

}  // namespace

const RayUnit& RayUnits::made(const Vec3i& unit) {
  UnitPage<RayUnit>& page = blocks_.madeOf(*block_);
  const int place = placeInBlock(unit);
  if (page.hasMark(place, markOf(unknown_))) return unknown_;
  if (page.hasMark(place, markOf(front_))) return front_;
  return page.at(place, own_unit_, [&] { return makeUnit(blocks_.scene(), *block_, unit); });
}

const UnitColours& RayUnits::coloursAt(const Vec3i& unit) {
  return blocks_.colouredOf(*block_).at(placeInBlock(unit), own_colours_, [&] {
    const UnitCorners corners = cornersOf(unit);
    return coloursOf(find(unit), [&](int d, int c) {
      return colouredAt(blocks_.scene(), block_->entry[corners.block[c]], corners.voxel[c], d);
    });
  });
}

}  // namespace dtsdf
