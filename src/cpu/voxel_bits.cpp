#include "cpu/voxel_bits.h"

#include <cstring>

#include "cpu/widest_vectors.h"
#include "kernels/render/depth_range.h"

namespace dtsdf {
namespace {

/// Flags of a voxel: known in a direction, from the first bit on, and
constexpr int kBehind = kDirectionCount, kNear = kBehind + 1;
static_assert(kNear < 8, "flags are gathered by bytes");

void addFlags(const Voxel* voxels, int direction, int32_t least_evidence, int32_t* flags) {
  withWidestVectors([=] {
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const Voxel& voxel = voxels[i];
      const auto known = static_cast<int32_t>(isKnown(voxel, least_evidence));
      const auto behind = static_cast<int32_t>(voxel.sdf_units < 0);
      const auto near = static_cast<int32_t>(isNearSurface(voxel));
      flags[i] |= known << direction | (known & behind) << kBehind | (known & near) << kNear;
    }
  });
}

/// One flag of each voxel.
void gather(const uint8_t* flags, int flag, BlockBits& bits) {
  for (int z = 0; z < kBlockSide; ++z) {
    uint64_t layer = 0;
    for (int y = 0; y < kBlockSide; ++y) {
      uint64_t row;
      std::memcpy(&row, flags + voxelIndex(0, y, z), sizeof(row));
      constexpr uint64_t kLowest = 0x0101010101010101u, kGather = 0x0102040810204080u;
      layer |= ((row >> flag & kLowest) * kGather >> 56) << kBlockSide * y;
    }
    bits.layer[z] = layer;
  }
}

/// Joins the corners of each unit. `of` gives the bits of a block.
template <class Operation, class Of>
void joinCorners(const BlocksAround& around, const Of& of, BlockBits& units) {
  uint64_t joined[kBlockSide + 1];
  for (int z = 0; z <= kBlockSide; ++z) {
    LayersAround layers;
    for (int c = 0; c < 4; ++c) {
      const VoxelBits* block = around[z < kBlockSide ? c : c + 4];
      layers.of[c] = block == nullptr ? 0 : of(*block).layer[z % kBlockSide];
    }
    joined[z] = joinInLayer<Operation>(layers);
  }
  for (int z = 0; z < kBlockSide; ++z) {
    units.layer[z] = Operation::join(joined[z], joined[z + 1]);
  }
}

}  // namespace

VoxelBits voxelBitsOf(const BlockEntry& entry, const VoxelStore& voxels, int32_t least_evidence) {
  int32_t flags[kVoxelsPerBlock] = {};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    addFlags(voxels.array(entry.array[d]), d, least_evidence, flags);
  }
  uint8_t bytes[kVoxelsPerBlock];
  for (int i = 0; i < kVoxelsPerBlock; ++i) bytes[i] = static_cast<uint8_t>(flags[i]);
  VoxelBits bits{};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    gather(bytes, d, bits.seen[d]);
    for (int z = 0; z < kBlockSide; ++z) bits.known.layer[z] |= bits.seen[d].layer[z];
  }
  gather(bytes, kBehind, bits.behind);
  gather(bytes, kNear, bits.near);
  return bits;
}

UnitBits unitBitsOf(const BlocksAround& around) {
  UnitBits units;
  for (int d = 0; d < kDirectionCount; ++d) {
    joinCorners<AnyOf>(
        around, [d](const VoxelBits& of) -> auto& { return of.seen[d]; }, units.seen[d]);
  }
  joinCorners<AllOf>(
      around, [](const VoxelBits& of) -> auto& { return of.known; }, units.known);
  joinCorners<AnyOf>(
      around, [](const VoxelBits& of) -> auto& { return of.behind; }, units.behind);
  return units;
}

}  // namespace dtsdf
