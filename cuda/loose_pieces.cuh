/// Loose pieces on the device: a block of threads finds them in the window of a block, a thread for
/// each row of it. For .cu files.
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
    return (piece & kTooManyLayers) == 0 &&
           isSmall(piece >> kShadowX & kPlaces, piece >> kShadowY & kPlaces, 0, most_units);
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

/// The labels of the units around a block's corners, which its threads ask for again and again: its
/// own and one more on each side. Along x as many as the window has.
struct CornerLabels {
  static constexpr int kSide = kBlockSide + 2;
  uint64_t four[kSide * kSide][kWindowSide / 4];  ///< Labels of four units, along x, in each.

  static __device__ bool hasRow(const Vec3i& unit) {
    return unit.y >= -1 && unit.y <= kBlockSide && unit.z >= -1 && unit.z <= kBlockSide;
  }
  static __device__ int rowOf(const Vec3i& unit) { return unit.y + 1 + kSide * (unit.z + 1); }

  __device__ UnitLabels operator()(const Vec3i& unit) const {
    const auto* labels = reinterpret_cast<const UnitLabels*>(four[rowOf(unit)]);
    return labels[unit.x + kMostLooseUnits];
  }
};

/// Reads this thread's row of the window, and copies its labels if they are around corners.
/// @return which of its units hold a surface.
__device__ inline uint32_t takeLabels(const LabelNeighbourhood& around, CornerLabels& labels) {
  static_assert(kMostLooseUnits == 4 && kBlockSide == 8, "half a row of a block on either side");
  const Vec3i first = firstOfRow(static_cast<int>(threadIdx.x));
  uint64_t four[kWindowSide / 4];
#pragma unroll  // reads all before it waits for any
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

/// What the threads of a block find in a window, each in its row.
class LooseFinder {
 public:
  __device__ LooseFinder(PieceTrees& trees, uint32_t surface, int most_units)
      : trees_(trees),
        surface_(surface),
        most_units_(most_units),
        row_(static_cast<int>(threadIdx.x)),
        y_(row_ % kWindowSide),
        z_(row_ / kWindowSide) {}

  /// Enters the units of loose pieces, all of which are in the window.
  __device__ void find(const LabelNeighbourhood& labels) {
    plant();
    if (y_ + 1 < kWindowSide) trees_.joinRows(row_, row_ + 1);
    __syncthreads();  // so that the trees are known before many join them at once
    if (z_ + 1 < kWindowSide) trees_.joinRows(row_, row_ + kWindowSide);
    const uint32_t small = smallUnits();
    const bool is_own = isOwn(y_) && isOwn(z_);
    if (!__syncthreads_or(is_own && (small & kOwnUnits) != 0)) return;  // as in most blocks
    forgetMarks();
    joinOverEdges(small, labels);
    const uint32_t beside = besideLarger(surface_ & ~small);
    const uint32_t still_small = smallUnits();
    noteBesideLarger(still_small & beside);
    enterLoose(still_small);
  }

 private:
  static constexpr uint32_t kOwnUnits = 0xffu << kMostLooseUnits;
  static __device__ bool isOwn(int place) {
    return place >= kMostLooseUnits && place < kMostLooseUnits + kBlockSide;
  }

  /// A tree for each run.
  __device__ void plant() {
    trees_.surface[row_] = static_cast<uint16_t>(surface_);
    trees_.loose[row_] = 0;
    forEachRun(surface_, [&](uint32_t run, uint32_t) { trees_.runs[run] = run; });
    __syncthreads();
  }

  /// Those of this thread's row whose pieces are small.
  __device__ uint32_t smallUnits() {
    __syncthreads();  // of the trees
    leaveMarks();
    __syncthreads();
    uint32_t small = 0;
    forEachRun(surface_, [&](uint32_t run, uint32_t units) {
      if (trees_.isSmallRoot(trees_.rootOf(run), most_units_)) small |= units;
    });
    return small;
  }

  /// Of all runs on their roots. Those of a warp that have the same one are put together before.
  __device__ void leaveMarks() {
    uint32_t rest = surface_, run = row_ * kRunsOfRow;
    for (; __any_sync(~0u, rest != 0); ++run) {
      const uint32_t next = withoutFirstRun(rest), units = rest & ~next;
      const uint32_t root = units != 0 ? trees_.rootOf(run) : 0;
      const int first = __ffs(static_cast<int>(__ballot_sync(~0u, units != 0))) - 1;
      const uint32_t common_root = __shfl_sync(~0u, root, first);
      const bool is_common = units != 0 && root == common_root;
      const uint32_t marks = units != 0 ? PieceTrees::marksOf(units, y_, z_, root, most_units_) : 0;
      const uint32_t common_marks = orOfWarp(is_common ? marks : 0);
      if (row_ % 32 == first) {
        atomicOr(&trees_.runs[root], common_marks);
      } else if (units != 0 && !is_common) {
        atomicOr(&trees_.runs[root], marks);
      }
      rest = next;
    }
  }

  /// Before pieces are joined once more, when nobody reads them.
  __device__ void forgetMarks() {
    forEachRun(surface_, [&](uint32_t run, uint32_t) { trees_.runs[run] &= PieceTrees::kNumber; });
    __syncthreads();
  }

  __device__ uint32_t rowAt(int y, int z) const {
    const bool is_in = y >= 0 && y < kWindowSide && z >= 0 && z < kWindowSide;
    return is_in ? trees_.surface[y + kWindowSide * z] : 0;
  }

  /// Which places of a row are beside a unit of another row over an edge, with nothing between.
  static __device__ uint32_t besideOf(uint32_t own, uint32_t other) {
    const uint32_t apart = other & ~own;
    return (apart << 1 | apart >> 1) & ~other;
  }

  /// Which units of this thread's row may be joined to others over edges, by where these are: few.
  /// All that visitOverEdges() can join, which decides.
  __device__ uint32_t besideEdges() const {
    uint32_t beside = 0;
    for (int y = -1; y <= 1; y += 2) {
      const uint32_t along_y = rowAt(y_ + y, z_), along_z = rowAt(y_, z_ + y);
      beside |= besideOf(surface_, along_y) | besideOf(surface_, along_z);
      for (int z = -1; z <= 1; z += 2) {
        beside |= rowAt(y_ + y, z_ + z) & ~along_y & ~rowAt(y_, z_ + z);
      }
    }
    return beside & surface_;
  }

  /// Joins small pieces to what they meet over edges.
  __device__ void joinOverEdges(uint32_t small, const LabelNeighbourhood& labels) {
    for (small &= besideEdges(); small != 0; small &= small - 1) {
      const int x = __ffs(static_cast<int>(small)) - 1;
      const Vec3i unit{x - kMostLooseUnits, y_ - kMostLooseUnits, z_ - kMostLooseUnits};
      visitOverEdges(labels, unit, [&](const Vec3i& other) {
        const int row = windowRow(other.y, other.z);
        trees_.join(trees_.runOf(row_, x), trees_.runOf(row, other.x + kMostLooseUnits));
      });
    }
  }

  /// Places of this thread's row that are no farther along any axis from a larger piece.
  __device__ uint32_t besideLarger(uint32_t larger) {
    constexpr uint32_t kWholeRow = (1u << kWindowSide) - 1u;
    for (int i = 0; i < most_units_; ++i) larger |= (larger << 1 & kWholeRow) | larger >> 1;
    return widenedAlong(widenedAlong(larger, y_, 1), z_, kWindowSide);
  }

  /// All of those that are so many rows apart, at most.
  __device__ uint32_t widenedAlong(uint32_t places, int at, int stride) {
    trees_.larger[row_] = static_cast<uint16_t>(places);
    __syncthreads();
    for (int i = 1; i <= most_units_; ++i) {
      if (at >= i) places |= trees_.larger[row_ - i * stride];
      if (at + i < kWindowSide) places |= trees_.larger[row_ + i * stride];
    }
    __syncthreads();
    return places;
  }

  /// Of pieces that have some of the units.
  __device__ void noteBesideLarger(uint32_t units_beside) {
    __syncthreads();  // of what has been read of the marks
    forEachRun(surface_, [&](uint32_t run, uint32_t units) {
      if ((units & units_beside) == 0) return;
      atomicOr(&trees_.runs[trees_.rootOf(run)], PieceTrees::kBesideLarger);
    });
    __syncthreads();
  }

  __device__ void enterLoose(uint32_t small) {
    uint32_t loose = 0;
    forEachRun(surface_, [&](uint32_t run, uint32_t units) {
      const bool is_beside = (trees_.runs[trees_.rootOf(run)] & PieceTrees::kBesideLarger) != 0;
      if (is_beside && (units & small) != 0) loose |= units;
    });
    trees_.loose[row_] = static_cast<uint16_t>(loose);
  }

  PieceTrees& trees_;
  const uint32_t surface_;
  const int most_units_, row_, y_, z_;
};

/// Enters the units of loose pieces, for all threads after their next barrier. By all of a block.
__device__ inline void findLoosePieces(const LabelNeighbourhood& labels, uint32_t surface,
                                       int most_units, PieceTrees& trees) {
  if (most_units == 0) {
    trees.loose[threadIdx.x] = 0;
  } else {
    LooseFinder(trees, surface, most_units).find(labels);
  }
}

}  // namespace gpu
}  // namespace dtsdf
