// Loose pieces on the device: a warp holds the window of a block, and lets pieces grow in it.
#include "corner_arrays.cuh"
#include "kernels/meshing/loose_pieces.h"
#include "launch.h"
#include "mesh_kernels.h"
#include "unit_sets.cuh"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kWarps = 2;  ///< Of a block of threads: few, as there may be few blocks to mesh.

/// What the lanes of a warp share.
struct WarpShared {
  LabelNeighbourhood labels;
  uint64_t grown[kWindowWords];
};

/// Those of a multiple of four units, read at once.
__device__ uint64_t fourLabels(const UnitLabels* labels) {
  return *reinterpret_cast<const uint64_t*>(labels);
}

/// A piece of the surface; once it is known not to be small, maybe a part of it.
template <class Part>
struct Piece {
  Part units;
  bool is_small;
};

/// The pieces of a surface, in a block or in a window.
template <class Part>
struct Pieces {
  Part surface;
  int most_units, lane;

  /// Two steps, as one takes no longer than to ask whether it was the last.
  __device__ Part grow(const Part& units) const {
    return grown(grown(units, lane) & surface, lane) & surface;
  }

  /// The piece that has these units, as far as they are joined over faces.
  __device__ Piece<Part> joinedOverFaces(Part units) const {
    for (;;) {
      const Part next = grow(units);
      const bool is_small = isSmall(next, most_units, lane);
      if (!is_small || !isAny(without(next, units))) return {next, is_small};
      units = next;
    }
  }

  /// Of some units one that is there, if any is.
  __device__ Part firstOf(const Part& units) const {
    const uint32_t having = __ballot_sync(~0u, hasUnits(units));
    return lane == __ffs(having) - 1 ? lowest(units) : Part{};
  }

  /// Those of some units that have small pieces, and all that have larger ones.
  struct BySize {
    Part small, larger;
  };
  __device__ BySize bySize(Part units) const {
    BySize found = {};
    while (isAny(units)) {
      const Piece<Part> piece = joinedOverFaces(firstOf(units));
      if (piece.is_small) {
        found.small = found.small | piece.units;
      } else {
        found.larger = within(surface, found.larger | piece.units);
      }
      units = without(units, found.small | found.larger);
    }
    return found;
  }

  /// All pieces of `among` that have some of the units.
  __device__ Part within(const Part& among, Part units) const {
    for (;;) {
      const Part next = grow(units) & among;
      if (!isAny(without(next, units))) return next;
      units = next;
    }
  }
};

/// Visits, for each of some units, those that it is joined to over edges.
template <class Visit>
__device__ void forEachOverEdges(const WindowPart& units, int lane, const WarpShared& shared,
                                 const Visit& visit) {
  for (int k = 0; k < 2; ++k) {
    for (uint64_t bits = units.word[k]; bits != 0; bits &= bits - 1) {
      const int bit = __ffsll(static_cast<int64_t>(bits)) - 1;
      visitOverEdges(shared.labels, windowUnit(2 * lane + k, bit),
                     [&](const Vec3i& other) { visit(k, uint64_t{1} << bit, other); });
    }
  }
}

/// Those of some units that are joined to others over edges.
__device__ WindowPart joinedOverEdges(const WindowPart& units, int lane, const WarpShared& shared) {
  WindowPart joined = {};
  forEachOverEdges(units, lane, shared,
                   [&](int k, uint64_t unit, const Vec3i&) { joined.word[k] |= unit; });
  return joined;
}

/// A piece with the units that it is joined to over edges.
__device__ WindowPart grownOverEdges(const WindowPart& piece, int lane, WarpShared& shared) {
  for (int k = 0; k < 2; ++k) shared.grown[2 * lane + k] = piece.word[k];
  __syncwarp();
  forEachOverEdges(piece, lane, shared, [&](int, uint64_t, const Vec3i& other) {
    atomicOr(reinterpret_cast<unsigned long long*>(&shared.grown[windowWord(other)]),
             static_cast<unsigned long long>(windowBit(other)));
  });
  __syncwarp();
  const WindowPart result{{shared.grown[2 * lane], shared.grown[2 * lane + 1]}};
  __syncwarp();  // before it is written again
  return result;
}

/// The units that hold a surface, of a block...
__device__ BlockPart surfaceOf(const UnitLabels* labels, int lane) {
  BlockPart part = {0};
  if (lane >= kHalfLayers) return part;
#pragma unroll
  for (int four = 0; four < 8; ++four) {
    part.rows |= surfaceBits(fourLabels(labels + 32 * lane + 4 * four)) << (4 * four);
  }
  return part;
}

/// ... and of a word of its window.
__device__ uint64_t surfaceOfWord(const LabelNeighbourhood& around, int word) {
  static_assert(kMostLooseUnits == kRowsPerWord && kBlockSide == 2 * kRowsPerWord,
                "the rows of a word are in one block, and four units of a row");
  const int y = kRowsPerWord * (word % kWordsPerLayer) - kMostLooseUnits;
  const int z = word / kWordsPerLayer - kMostLooseUnits;
  uint64_t rows = 0;
#pragma unroll
  for (int x = -kMostLooseUnits; x < kBlockSide + kMostLooseUnits; x += kMostLooseUnits) {
    const UnitSource source = unitSource({x, y, z});
    const UnitLabels* labels = around.block[source.block];
    if (labels == nullptr) continue;
    for (int row = 0; row < kRowsPerWord; ++row) {
      const uint64_t bits = surfaceBits(fourLabels(labels + source.unit + row * kBlockSide));
      rows |= bits << (kWindowSide * row + x + kMostLooseUnits);
    }
  }
  return rows;
}

/// Of the units of a block whose pieces look small within it, those that loose pieces have.
__device__ WindowPart looseUnits(const WindowPart& in_doubt, int most_units, int lane,
                                 WarpShared& shared) {
  const WindowPart surface{
      {surfaceOfWord(shared.labels, 2 * lane), surfaceOfWord(shared.labels, 2 * lane + 1)}};
  const Pieces<WindowPart> pieces{surface, most_units, lane};
  WindowPart small = pieces.bySize(in_doubt).small, loose = {};
  if (!isAny(small)) return loose;
  WindowPart beside_larger = pieces.bySize(surface).larger;
  for (int i = 0; i < most_units; ++i) {
    beside_larger = grownAlongX(grownAlongY(grownAlongZ(beside_larger), lane));
  }
  // Most are joined to nothing, and are all seen at once.
  WindowPart rest = pieces.within(small, joinedOverEdges(small, lane, shared));
  loose = pieces.within(without(small, rest), without(small, rest) & beside_larger);
  while (isAny(rest)) {
    Piece<WindowPart> piece{pieces.firstOf(rest), true};
    for (bool grows = true; grows && piece.is_small;) {
      const WindowPart before = piece.units;
      piece = pieces.joinedOverFaces(grownOverEdges(before, lane, shared));
      grows = isAny(without(piece.units, before));
    }
    if (piece.is_small && isAny(piece.units & beside_larger)) loose = loose | piece.units;
    rest = without(rest, piece.units);
  }
  return loose;
}

/// One warp per block to mesh, in strides.
__global__ void __launch_bounds__(32 * kWarps) findLoosePiecesKernel(MapView map, MeshView mesh) {
  waitForTheOneAhead();
  __shared__ WarpShared of_warp[kWarps];
  WarpShared& shared = of_warp[threadIdx.x / 32];
  const auto lane = static_cast<int>(threadIdx.x % 32);
  const int most_units = mesh.rules.most_loose_units;
  const uint32_t count = mesh.counters->reached + mesh.counters->adjoining;
  const uint32_t warps = gridDim.x * kWarps;
  for (uint32_t b = blockIdx.x * kWarps + threadIdx.x / 32; b < count; b += warps) {
    const int32_t slot = mesh.slots[b];
    const BlockPart surface = surfaceOf(map.unit_labels.record(slot), lane);
    BlockPart units = {};
    if (most_units > 0) units = Pieces<BlockPart>{surface, most_units, lane}.bySize(surface).small;
    if (isAny(units)) {
      if (lane < kBlocksAround) {
        const int32_t beside = findSlot(map, packKey(keyOfSlot(map, slot) + aroundOffset(lane)));
        shared.labels.block[lane] = beside < 0 ? nullptr : map.unit_labels.record(beside);
      }
      __syncwarp();
      units = toBlock(looseUnits(toWindow(units, lane), most_units, lane, shared), lane);
      __syncwarp();  // before the labels of the next block
    }
    if (lane < kHalfLayers) {
      mesh.loose_units[static_cast<size_t>(b) * kHalfLayers + lane] = units.rows;
    }
  }
}

}  // namespace

void findLoosePieces(const MapView& map, const MeshView& mesh, int thread_blocks,
                     const Stream& stream) {
  const int blocks = thread_blocks * (kThreads / 32 / kWarps);
  launchBehind(findLoosePiecesKernel, blocks, 32 * kWarps, 0, stream, map, mesh);
  DTSDF_CHECK_LAUNCH("findLoosePiecesKernel");
}

NamedKernel looseKernel() { return DTSDF_NAMED_KERNEL(findLoosePiecesKernel, 0); }

}  // namespace gpu
}  // namespace dtsdf
