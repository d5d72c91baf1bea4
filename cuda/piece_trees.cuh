/// The pieces of a surface in the window around a block, in shared memory: a block of threads makes
/// them, a thread for each row. For .cu files.
#pragma once

#include "kernels/meshing/loose_pieces.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {

static_assert(kThreads == kWindowRows, "a thread for each row of a window");

constexpr int kRunsOfRow = kWindowSide / 2, kRunsOfWindow = kWindowRows * kRunsOfRow;

/// The pieces in a window: trees of runs, the units of a row that hang together along x. A run's
/// number is made of its row and of how many are before it there; a root's is the least of its
/// piece, so no unit of it is in a lower layer along z. Whatever is read while others join trees is
/// read past the compiler, and written by atomics: links only ever lead to lower numbers.
struct PieceTrees {
  uint16_t surface[kWindowRows];  ///< Bits of the units that hold one.
  uint16_t larger[kWindowRows];   ///< Places of larger pieces, for the rows beside them.
  uint16_t loose[kWindowRows];    ///< Those of loose pieces.
  /// Of each run the number of the one above it; of a root its own, and marks of its piece. In one
  /// word, as shared memory decides how many blocks are meshed at a time.
  uint32_t runs[kRunsOfWindow];

  static constexpr uint32_t kNumber = kRunsOfWindow - 1;
  static_assert((kRunsOfWindow & kNumber) == 0, "a number fills its bits");

  /// Marks: the piece comes near a larger one; it has too many layers along z; where it is along x
  /// and y, each folded.
  static constexpr uint32_t kBesideLarger = 1u << 14, kTooManyLayers = 1u << 15;
  static constexpr int kShadowX = 16, kShadowY = kShadowX + kFoldedPlaces;
  static_assert(kNumber < kBesideLarger && kShadowY + kFoldedPlaces == 32, "a word holds them");

  /// @param unit Of the block.
  __device__ bool isLoose(const Vec3i& unit) const {
    return (loose[windowRow(unit.y, unit.z)] >> (unit.x + kMostLooseUnits) & 1) != 0;
  }

  __device__ int runOf(int row, int x) const {
    const uint32_t units = surface[row], firsts = units & ~(units << 1);
    return row * kRunsOfRow + __popc(firsts & ((2u << x) - 1u)) - 1;
  }

  __device__ uint32_t aboveOf(uint32_t run) const { return readShared(&runs[run]) & kNumber; }

  /// Others may join trees meanwhile. Shortens the way for those that come later.
  __device__ uint32_t rootOf(uint32_t run) {
    uint32_t above = aboveOf(run);
    while (above != run) {
      const uint32_t next = aboveOf(above);
      if (next != above) atomicMin(&runs[run], next);  // which is no root, so has no marks
      run = above;
      above = next;
    }
    return run;
  }

  /// @pre no root has marks.
  __device__ void join(uint32_t a, uint32_t b) {
    for (;;) {
      a = rootOf(a);
      b = rootOf(b);
      if (a == b) return;
      const uint32_t lower = a < b ? a : b, upper = a < b ? b : a;
      if (atomicCAS(&runs[upper], upper, lower) == upper) return;
    }
  }

  /// Joins what shares a face between two rows.
  __device__ void joinRows(int row, int other) {
    uint32_t shared = surface[row] & surface[other];
    while (shared != 0) {
      const int x = __ffs(static_cast<int>(shared)) - 1;
      join(runOf(row, x), runOf(other, x));
      shared &= shared + (1u << x);  // the run's others are joined as well
    }
  }

  /// What units of a row leave as marks on the root of their piece.
  static __device__ uint32_t marksOf(uint32_t units, int y, int z, uint32_t root, int most_units) {
    const int layers = z - static_cast<int>(root / (kRunsOfRow * kWindowSide));
    return folded(units) << kShadowX | folded(1u << y) << kShadowY |
           (spansMore((2u << layers) - 1u, most_units) ? kTooManyLayers : 0);
  }

  /// @pre no piece is joined to another meanwhile, nor gets marks.
  __device__ bool isSmallRoot(uint32_t root, int most_units) const {
    constexpr uint32_t kPlaces = (1u << kFoldedPlaces) - 1u;
    const uint32_t piece = runs[root];
    const Shadow shadow{piece >> kShadowX & kPlaces, piece >> kShadowY & kPlaces, 0};
    return (piece & kTooManyLayers) == 0 && isSmall(shadow, most_units);
  }
};

__device__ inline uint32_t orOfWarp(uint32_t bits) {
#if __CUDA_ARCH__ >= 800
  return __reduce_or_sync(~0u, bits);
#else
#pragma unroll
  for (int lanes = 16; lanes > 0; lanes /= 2) bits |= __shfl_xor_sync(~0u, bits, lanes);
  return bits;
#endif
}

/// What is left of a row's units without those of its first run.
__device__ inline uint32_t withoutFirstRun(uint32_t units) {
  return units & (units + (units & (0u - units)));
}

/// Calls visit(run, its units as bits) for the runs of this thread's row.
template <class Visit>
__device__ void forEachRun(uint32_t surface, const Visit& visit) {
  auto run = static_cast<uint32_t>(threadIdx.x * kRunsOfRow);
  for (; surface != 0; ++run) {
    const uint32_t rest = withoutFirstRun(surface);
    visit(run, surface & ~rest);
    surface = rest;
  }
}

}  // namespace gpu
}  // namespace dtsdf
