/// Finds which neighbouring pixels are fused as one surfel.
///
/// Where a voxel is many pixels wide, neighbouring pixels of a smooth surface update the same
/// voxels with almost the same plane, so their mean gives the same result for a fraction of the
/// work. Each patch of 4 x 4 pixels is merged as a whole or, failing that, in quads of 2 x 2 pixels
/// where possible.
#pragma once

#include "kernels/surfels/links.h"

namespace dtsdf {

constexpr int kPatchSide = 4;  ///< In pixels.
constexpr int kQuadSide = 2;

/// Number of patches along a side of the image; the last may extend beyond it.
DTSDF_HD int patchesAlong(int pixels) { return (pixels + kPatchSide - 1) / kPatchSide; }

struct PixelSquare {
  Pixel first;  ///< The corner with the smallest coordinates.
  int32_t side;
};

/// Whether the surface turns little across a square, that is, whether the row fits' values have
/// similar slopes before and after it, each measured over the square's width. `along` is the
/// stride from pixel to pixel in the direction of the slopes, `across` the stride from one line to
/// the next.
DTSDF_HD bool turnsLittle(const ImageView& image, const PixelSquare& square, int64_t along,
                          int64_t across, float largest_turn) {
  const float* line = image.row_value + pixelIndex(image.frame, square.first);
  const int64_t to_last = (square.side - 1) * along, to_beside = square.side * along;
  for (int i = 0; i < square.side; ++i, line += across) {
    const float before = line[-to_beside], first = line[0];
    const float last = line[to_last], after = line[to_last + to_beside];
    if (!(before > 0.0f && first > 0.0f && last > 0.0f && after > 0.0f)) return false;
    const float turn = (first - before) - (after - last);
    if (!(fabsf(turn) <= largest_turn * static_cast<float>(square.side))) return false;
  }
  return true;
}

/// Whether all neighbours in a square are linked.
DTSDF_HD bool isLinked(const ImageView& image, const PixelSquare& square) {
  const PixelLinks* row = image.links + pixelIndex(image.frame, square.first);
  for (int y = 0; y < square.side; ++y, row += image.frame.width) {
    for (int x = 0; x < square.side; ++x) {
      const PixelLinks needed = static_cast<PixelLinks>((x < square.side - 1 ? kLinkRight : 0) |
                                                        (y < square.side - 1 ? kLinkDown : 0));
      if ((row[x] & needed) != needed) return false;
    }
  }
  return true;
}

/// Whether a square lies in the image, with a margin as wide as itself on all sides.
DTSDF_HD bool hasSurroundings(const FrameView& frame, const PixelSquare& square) {
  const auto& [u, v] = square.first;
  const int beside = square.side, beyond = square.side + beside;
  return u >= beside && v >= beside && u + beyond <= frame.width && v + beyond <= frame.height;
}

/// Whether a square of pixels is fused as one surfel: all must be measured and linked, the square
/// must be narrow compared with a voxel and at most a voxel deep, and the surface must be measured
/// all around it and turn little.
DTSDF_HD bool isMerged(const ImageView& image, const PixelSquare& square,
                       const SurfelSettings& surfels) {
  const FrameView& frame = image.frame;
  const SurfelRules& rules = surfels.rules;
  if (!hasSurroundings(frame, square)) return false;
  const float width_px_m = rules.merged_width * frame.intrinsics.fx * frame.voxel_size_m;
  const float side = static_cast<float>(square.side);
  const float* row = image.inverse_depth + pixelIndex(frame, square.first);
  if (!(side <= width_px_m * *row)) return false;
  float least = *row, most = *row;
  for (int y = 0; y < square.side; ++y, row += frame.width) {
    for (int x = 0; x < square.side; ++x) {
      least = minimum(least, row[x]);
      most = maximum(most, row[x]);
    }
  }
  if (!(side <= width_px_m * least) || !isLinked(image, square) ||
      !(most - least <= frame.voxel_size_m * least * most)) {  // the range of z, times least * most
    return false;
  }
  // The largest turn, as a change in the slope of 1 / z, for a surface that faces the camera.
  const float turn = rules.merged_turn * most / frame.intrinsics.fx;
  return turnsLittle(image, square, 1, frame.width, turn) &&
         turnsLittle(image, square, frame.width, 1, turn);
}

/// The merged squares of a patch: bit kPatchBit for the whole patch, or bit q for each merged quad.
using MergedPatch = uint32_t;
constexpr int kPatchBit = 4;

/// Whether the square that corresponds to bit `bit` of MergedPatch is merged, in the patch that
/// starts at `first`.
DTSDF_HD bool isBitMerged(const ImageView& image, const Pixel& first, int bit,
                          const SurfelSettings& surfels) {
  if (bit == kPatchBit) return isMerged(image, {first, kPatchSide}, surfels);
  const Pixel quad{first.u + kQuadSide * (bit & 1), first.v + kQuadSide * (bit >> 1)};
  return quad.u < image.frame.width && isMerged(image, {quad, kQuadSide}, surfels);
}

/// The merged squares of a patch, given the bits of all squares that can be merged: the whole
/// patch, otherwise quads.
DTSDF_HD MergedPatch wholeOrQuads(uint32_t bits) {
  constexpr MergedPatch kWhole = 1u << kPatchBit;
  return (bits & kWhole) != 0 ? kWhole : bits & (kWhole - 1u);
}

DTSDF_HD MergedPatch mergePatch(const ImageView& image, const Pixel& first,
                                const SurfelSettings& surfels) {
  uint32_t bits = 0;
  for (int bit = kPatchBit; bit >= 0 && bits >> kPatchBit == 0; --bit) {
    if (isBitMerged(image, first, bit, surfels)) bits |= 1u << bit;
  }
  return wholeOrQuads(bits);
}

/// The unmerged pixels of a patch in image row v, one bit each.
DTSDF_HD uint32_t singlesInRow(MergedPatch patch, int v) {
  if (patch >> kPatchBit & 1) return 0;
  const MergedPatch quads = patch >> ((v & kQuadSide) != 0 ? 2 : 0);
  return ((quads & 1) != 0 ? 0u : 3u) | ((quads & 2) != 0 ? 0u : 12u);
}

/// Side of the square that starts at a pixel: 1 for a single pixel, 0 for the other pixels of a
/// square.
DTSDF_HD int mergedSide(MergedPatch patch, const Pixel& pixel) {
  const int x = pixel.u & (kPatchSide - 1), y = pixel.v & (kPatchSide - 1);
  if (patch >> kPatchBit & 1) return x == 0 && y == 0 ? kPatchSide : 0;
  if (singlesInRow(patch, pixel.v) >> x & 1) return 1;
  return (x & 1) == 0 && (y & 1) == 0 ? kQuadSide : 0;
}

}  // namespace dtsdf
