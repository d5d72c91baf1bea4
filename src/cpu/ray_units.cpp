#include "cpu/ray_units.h"

#include <algorithm>
#include <iterator>

namespace dtsdf {
namespace {

constexpr int kLastInBlock = kBlockSide - 1;

/// Samples of a unit that were fetched.
struct FetchedSamples {
  using Real = float;
  using Bits = int32_t;
  static constexpr int kUnits = 1;

  Sample corner[kDirectionCount][kCubeCorners];
  uint32_t observed = 0;

  float sdf(int direction, int c) const { return corner[direction][c].sdf; }
  float weight(int direction, int c) const { return corner[direction][c].weight; }
  bool isObserved(int direction) const { return (observed >> direction & 1) != 0; }
  bool maySpeak(int direction) const { return isObserved(direction); }
};

bool hasArrays(const BlockEntry& entry) {
  return std::any_of(std::begin(entry.array), std::end(entry.array),
                     [](int32_t array) { return array != kNoArray; });
}

}  // namespace

RayUnits::RayUnits(const RayScene& scene)
    : scene_(scene),
      origin_block_(blockOfVoxel(scene.frame.origin_voxel)),
      units_(std::make_unique<KnownUnit[]>(kUnits)),
      blocks_(std::make_unique<KnownBlock[]>(kBlocks)) {
  if (scene.painted) {
    colours_ = std::make_unique<KnownColours[]>(kUnits);
  }
}

void RayUnits::lookUp(const BlockKey& key, KnownBlock& known) const {
  const int32_t slot = isRepresentable(key) ? scene_.map.table.find(packKey(key)) : -1;
  const int32_t number =
      slot < 0 ? kNotInView : scene_.number_of_slot[static_cast<size_t>(slot)];
  known.key = key;
  known.entry = slot < 0 ? nullptr : &scene_.map.table.block(slot);
  // A block whose arrays have gone may stay in the table of one backend longer than of the other.
  if (known.entry != nullptr && !hasArrays(*known.entry)) known.entry = nullptr;
  known.voxels =
      number == kNotInView ? nullptr : &scene_.known[static_cast<size_t>(number)];
}

RayUnits::Corner RayUnits::cornerAt(const Vec3i& unit, int c) {
  const Vec3i at =
      unit + scene_.frame.origin_voxel + Vec3i{c & 1, c >> 1 & 1, c >> 2 & 1};
  return {blockAt(blockOfVoxel(at)).entry,
          voxelIndex(at.x & kLastInBlock, at.y & kLastInBlock, at.z & kLastInBlock)};
}

RayUnit RayUnits::make(const Vec3i& unit) {
  FetchedSamples samples;
  Corner corners[kCubeCorners];
  for (int c = 0; c < kCubeCorners; ++c) {
    corners[c] = cornerAt(unit, c);
    if (corners[c].entry == nullptr) return unitWithoutSurface(UnitState::kUnknown);
  }
  for (int d = 0; d < kDirectionCount; ++d) {
    float greatest = 0.0f;
    for (int c = 0; c < kCubeCorners; ++c) {
      const int32_t array = corners[c].entry->array[d];
      samples.corner[d][c] =
          array == kNoArray
              ? Sample{0.0f, 0.0f}
              : sampleOf(scene_.map.voxels.array(array)[corners[c].voxel], scene_.least_evidence);
      greatest = maximum(greatest, samples.corner[d][c].weight);
    }
    samples.observed |= greatest > 0.0f ? 1u << d : 0u;
  }
  const Vec3f middle = toFloat(unit) + Vec3f{0.5f, 0.5f, 0.5f};
  return makeRayUnit(kMeshTables, scene_.rules, samples, scene_.directional,
                     middle - scene_.frame.T_L_C.t);
}

ColouredSample RayUnits::colouredAt(const Corner& corner, int direction) const {
  const int32_t array = corner.entry == nullptr ? kNoArray : corner.entry->array[direction];
  if (array == kNoArray) return {{0.0f, 0.0f}, {0, 0, 0, 0}};
  const Sample sample =
      sampleOf(scene_.map.voxels.array(array)[corner.voxel], scene_.least_evidence);
  const int32_t number = scene_.map.table.colourOf(array, brickOf(corner.voxel));
  if (number == kNoArray) return {sample, {0, 0, 0, 0}};
  return {sample, scene_.map.colours.array(number)[placeInBrick(corner.voxel)]};
}

const UnitColours& RayUnits::coloursAt(const Vec3i& unit) {
  KnownColours& known = colours_[placeOf(unit)];
  if (known.at != unit) {
    Corner corners[kCubeCorners];
    for (int c = 0; c < kCubeCorners; ++c) corners[c] = cornerAt(unit, c);
    known.at = unit;
    known.colours =
        coloursOf(find(unit), [&](int d, int c) { return colouredAt(corners[c], d); });
  }
  return known.colours;
}

}  // namespace dtsdf
