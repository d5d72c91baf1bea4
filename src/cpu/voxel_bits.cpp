#include "cpu/voxel_bits.h"

#include <cstring>

#include "cpu/widest_vectors.h"
#include "kernels/render/depth_range.h"

namespace dtsdf {
namespace {

/// Flags of a voxel.
constexpr int kKnown = 0, kBehind = 1, kNear = 2;

void addFlags(const Voxel* voxels, int32_t least_evidence, int32_t* flags) {
  withWidestVectors([=] {
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const Voxel& voxel = voxels[i];
      const auto known = static_cast<int32_t>(isKnown(voxel, least_evidence));
      const auto behind = static_cast<int32_t>(voxel.sdf_units < 0);
      const auto near = static_cast<int32_t>(isNearSurface(voxel));
      flags[i] |= known << kKnown | (known & behind) << kBehind | (known & near) << kNear;
    }
  });
}

/// One flag of each voxel.
BlockBits bitsOf(const uint8_t* flags, int flag) {
  BlockBits bits{};
  for (int row = 0; row < kBlockSide * kBlockSide; ++row) {
    uint64_t word;
    std::memcpy(&word, flags + kBlockSide * row, sizeof(word));
    constexpr uint64_t kLowest = 0x0101010101010101u, kGather = 0x0102040810204080u;
    const uint64_t byte = ((word >> flag) & kLowest) * kGather >> 56;
    bits.layer[row / kBlockSide] |= byte << kBlockSide * (row % kBlockSide);
  }
  return bits;
}

struct And {
  static uint64_t join(uint64_t a, uint64_t b) { return a & b; }
};
struct Or {
  static uint64_t join(uint64_t a, uint64_t b) { return a | b; }
};

/// The layers of four blocks side by side, by the corner of a unit: those around a layer's units.
using LayersAround = uint64_t[4];

/// Joins each voxel of the first layer with the next ones along x and y.
template <class Operation>
uint64_t joinInLayer(const LayersAround& layers) {
  const auto along_x = [](uint64_t layer, uint64_t next) {
    constexpr uint64_t kFirst = 0x0101010101010101u;
    const uint64_t shifted = (layer >> 1 & ~(kFirst << 7)) | (next & kFirst) << 7;
    return Operation::join(layer, shifted);
  };
  constexpr int kRow = kBlockSide, kLastRow = kBlockSide * (kBlockSide - 1);
  const uint64_t here = along_x(layers[0], layers[1]), beyond = along_x(layers[2], layers[3]);
  return Operation::join(here, here >> kRow | beyond << kLastRow);
}

/// Joins the corners of each unit.
template <class Operation>
BlockBits joinCorners(const VoxelBits* const (&around)[8], BlockBits VoxelBits::*kind) {
  uint64_t joined[kBlockSide + 1];
  for (int z = 0; z <= kBlockSide; ++z) {
    LayersAround layers;
    for (int c = 0; c < 4; ++c) {
      const VoxelBits* block = around[z < kBlockSide ? c : c + 4];
      layers[c] = block == nullptr ? 0 : (block->*kind).layer[z % kBlockSide];
    }
    joined[z] = joinInLayer<Operation>(layers);
  }
  BlockBits bits;
  for (int z = 0; z < kBlockSide; ++z) bits.layer[z] = Operation::join(joined[z], joined[z + 1]);
  return bits;
}

}  // namespace

VoxelBits voxelBitsOf(const BlockEntry& entry, const VoxelStore& voxels, int32_t least_evidence) {
  int32_t flags[kVoxelsPerBlock] = {};
  for (const int32_t array : entry.array) {
    if (array != kNoArray) addFlags(voxels.array(array), least_evidence, flags);
  }
  uint8_t bytes[kVoxelsPerBlock];
  for (int i = 0; i < kVoxelsPerBlock; ++i) bytes[i] = static_cast<uint8_t>(flags[i]);
  return {bitsOf(bytes, kKnown), bitsOf(bytes, kBehind), bitsOf(bytes, kNear)};
}

UnitBits unitBitsOf(const VoxelBits* const (&around)[8]) {
  return {joinCorners<And>(around, &VoxelBits::known), joinCorners<Or>(around, &VoxelBits::behind)};
}

}  // namespace dtsdf
