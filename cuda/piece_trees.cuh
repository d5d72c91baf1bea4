/// The pieces of a surface in the window around a block, in shared memory: a block of threads makes
/// them, a thread for each row. For .cu files.
#pragma once

#include "kernels/meshing/loose_pieces.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {

static_assert(kThreads == kWindowRows, "a thread for each row of a window");

constexpr int kRunsOfRow = kWindowSide / 2;

/// The pieces in a window: trees of runs, the units of a row that hang together along x. A run's
/// number is made of its row and of how many are before it there; a root's is the least of its
/// piece. Whatever is read while others join trees is read past the compiler, and written by
/// atomics: links only ever lead to lower numbers.
struct PieceTrees {
  uint16_t surface[kWindowRows];  ///< Bits of the units that hold one.
  uint16_t larger[kWindowRows];   ///< Places of larger pieces, for the rows beside them.
  uint16_t loose[kWindowRows];    ///< Those of loose pieces.
  uint32_t parent[kWindowRows * kRunsOfRow];
  uint32_t shadow_xy[kWindowRows * kRunsOfRow];  ///< Of a root's piece: 16 bits of each.
  uint32_t shadow_z[kWindowRows * kRunsOfRow];   ///< And kBesideLarger.

  /// The piece comes near a larger one.
  static constexpr uint32_t kBesideLarger = 1u << 31;

  /// @param unit Of the block.
  __device__ bool isLoose(const Vec3i& unit) const {
    return (loose[windowRow(unit.y, unit.z)] >> (unit.x + kMostLooseUnits) & 1) != 0;
  }

  __device__ int runOf(int row, int x) const {
    const uint32_t units = surface[row], firsts = units & ~(units << 1);
    return row * kRunsOfRow + __popc(firsts & ((2u << x) - 1u)) - 1;
  }

  /// Others may join trees meanwhile. Shortens the way for those that come later.
  __device__ uint32_t rootOf(uint32_t run) {
    uint32_t above = readShared(&parent[run]);
    while (above != run) {
      const uint32_t next = readShared(&parent[above]);
      if (next != above) atomicMin(&parent[run], next);
      run = above;
      above = next;
    }
    return run;
  }

  __device__ void join(uint32_t a, uint32_t b) {
    for (;;) {
      a = rootOf(a);
      b = rootOf(b);
      if (a == b) return;
      const uint32_t lower = a < b ? a : b, upper = a < b ? b : a;
      if (atomicCAS(&parent[upper], upper, lower) == upper) return;
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

  __device__ void throwShadow(uint32_t root, uint32_t xy, uint32_t z) {
    atomicOr(&shadow_xy[root], xy);
    atomicOr(&shadow_z[root], z);
  }

  /// @pre no piece is joined to another meanwhile, nor gets a shadow.
  __device__ bool isSmallRoot(uint32_t root, int most_units) const {
    const uint32_t xy = shadow_xy[root];
    return isSmall({xy & 0xffffu, xy >> 16, shadow_z[root] & 0xffffu}, most_units);
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

/// Calls visit(run, its units as bits) for the runs of this thread's row.
template <class Visit>
__device__ void forEachRun(uint32_t surface, const Visit& visit) {
  auto run = static_cast<uint32_t>(threadIdx.x * kRunsOfRow);
  for (; surface != 0; ++run) {
    const uint32_t rest = surface & (surface + (surface & (0u - surface)));
    visit(run, surface & ~rest);
    surface = rest;
  }
}

}  // namespace gpu
}  // namespace dtsdf
