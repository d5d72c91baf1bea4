/// Finds loose pieces on the device, with one thread per row of a block's window. For .cu files.
#pragma once

#include "kernels/meshing/loose_pieces.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {

static_assert(kThreads == kWindowSide * kWindowSide, "a thread for each row of a window");

__device__ inline uint32_t warpOr(uint32_t bits) {
#if __CUDA_ARCH__ >= 800
  return __reduce_or_sync(~0u, bits);
#else
#pragma unroll
  for (int lanes = 16; lanes > 0; lanes /= 2) bits |= __shfl_xor_sync(~0u, bits, lanes);
  return bits;
#endif
}

__device__ inline int rowOf(int thread) {
  return windowRow(thread % kWindowSide - kMaxLooseUnits, thread / kWindowSide - kMaxLooseUnits);
}

/// Shared memory in which warps exchange their results.
using WarpBits = uint64_t[kThreads / 32];

/// A team for LoosePieces: a thread block, with one thread for each row of the window.
class RowsAtOnce {
 public:
  static constexpr bool kAtOnce = true;

  __device__ explicit RowsAtOnce(WarpBits& warps)
      : warps_(warps), row_(rowOf(static_cast<int>(threadIdx.x))) {}

  template <class Visit>
  __device__ void each(const Visit& visit) const {
    visit(row_);
    __syncthreads();
  }
  template <class Visit>
  __device__ void begin(int row, const Visit& visit) const {
    if (row == row_) visit(row_);
    __syncthreads();
  }
  template <class Visit>
  __device__ void eachOfPiece(const Visit& visit) const {
    each(visit);
  }
  template <class Holds>
  __device__ bool any(const Holds& holds) const {
    return __syncthreads_or(holds(row_)) != 0;
  }
  template <class Bits>
  __device__ uint64_t allOf(const Bits& bits) const {
    const uint64_t own = bits(row_);
    share(uint64_t{warpOr(static_cast<uint32_t>(own >> 32))} << 32 |
          warpOr(static_cast<uint32_t>(own)));
    uint64_t all = 0;
    for (const uint64_t warp : warps_) all |= warp;
    __syncthreads();
    return all;
  }
  template <class Bits>
  __device__ int firstOf(const Bits& bits) const {
    share(__ballot_sync(~0u, bits(row_) != 0));
    int first = -1;
    for (int warp = kThreads / 32 - 1; warp >= 0; --warp) {
      if (warps_[warp] != 0) first = 32 * warp + __ffsll(static_cast<long long>(warps_[warp])) - 1;
    }
    __syncthreads();
    return first < 0 ? -1 : rowOf(first);
  }
  __device__ bool add(uint32_t bits, uint16_t& row) const {
    const auto address = reinterpret_cast<uintptr_t>(&row);
    const uint32_t shift = 8 * (address & 2);
    const uint32_t before =
        atomicOr(reinterpret_cast<uint32_t*>(address & ~uintptr_t{3}), bits << shift);
    return (bits & ~(before >> shift)) != 0;
  }

 private:
  __device__ void share(uint64_t bits) const {
    if (threadIdx.x % 32 == 0) warps_[threadIdx.x / 32] = bits;
    __syncthreads();
  }

  WarpBits& warps_;
  const int row_;
};

/// A copy of the labels that are read most often: those of the block's units and one more on each
/// side; along x, of the whole window.
struct CornerLabels {
  static constexpr int kSide = kBlockSide + 2;
  uint64_t four[kSide * kSide][kWindowSide / 4];  ///< Each has the labels of four units along x.

  static __device__ bool hasRow(const Vec3i& unit) {
    return unit.y >= -1 && unit.y <= kBlockSide && unit.z >= -1 && unit.z <= kBlockSide;
  }
  static __device__ int rowOf(const Vec3i& unit) { return unit.y + 1 + kSide * (unit.z + 1); }

  __device__ UnitLabels operator()(const Vec3i& unit) const {
    const auto* labels = reinterpret_cast<const UnitLabels*>(four[rowOf(unit)]);
    return labels[unit.x + kMaxLooseUnits];
  }
};

/// Reads this thread's row of the window, and copies its labels if CornerLabels has the row.
/// @return a bit for each unit of the row that has a surface.
__device__ inline uint32_t takeLabels(const LabelNeighbourhood& around, CornerLabels& labels) {
  static_assert(kMaxLooseUnits == 4 && kBlockSide == 8, "half a row of a block on either side");
  const Vec3i first = firstOfRow(rowOf(static_cast<int>(threadIdx.x)));
  uint64_t four[kWindowSide / 4];
#pragma unroll  // all reads are issued before the first is needed
  for (int n = 0; n < kWindowSide / 4; ++n) {
    const CornerSource source = unitSource(first + gridStep(0, 4 * n));
    const UnitLabels* block = around[source.block];
    four[n] = block == nullptr ? 0 : *reinterpret_cast<const uint64_t*>(block + source.voxel);
  }
  uint32_t surface = 0;
#pragma unroll
  for (int n = 0; n < kWindowSide / 4; ++n) {
    if (CornerLabels::hasRow(first)) labels.four[CornerLabels::rowOf(first)][n] = four[n];
    surface |= surfaceBits(four[n]) << (4 * n);
  }
  return surface;
}

/// Writes the units of loose pieces to `small` of a window; they are visible after the next
/// barrier. All threads of the thread block must call it.
/// @param surface Bits of the units with a surface in the thread's row.
__device__ inline void findLoosePieces(const LabelNeighbourhood& labels, uint32_t surface,
                                       int max_units, WarpBits& warps, LooseWindow& window) {
  const RowsAtOnce rows(warps);
  for (int i = threadIdx.x; i < kWindowRows; i += kThreads) window.piece[i] = window.small[i] = 0;
  if (max_units == 0) return;
  rows.each([&](int row) { window.surface[row] = static_cast<uint16_t>(surface); });
  LoosePieces(rows, labels, max_units, window).find();
}

/// @param unit A unit of the block.
__device__ inline bool isLoose(const LooseWindow& window, const Vec3i& unit) {
  return (window.small[windowRow(unit.y, unit.z)] >> (unit.x + kMaxLooseUnits) & 1) != 0;
}

}  // namespace gpu
}  // namespace dtsdf
