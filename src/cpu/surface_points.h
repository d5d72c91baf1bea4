/// The points of surfaces that a colour image is to paint, found and drawn side by side, in loops
/// that compilers turn into vector instructions. Same bits as the rules of kernels/colour.
#pragma once

#include "cpu/columns.h"
#include "cpu/widest_vectors.h"
#include "kernels/colour/hiding.h"
#include "kernels/colour/surface_point.h"

namespace dtsdf {

inline int listNear(const PointView& of_image, const Voxel* voxels, int* near) {
  constexpr int kRow = 16;          // so many are asked at once, as most rows have none
  const PointView view = of_image;  // a copy of its own, which no result can overlap
  int count = 0;
  for (int row = 0; row < kVoxelsPerBlock; row += kRow) {
    int32_t is_near[kRow], any = 0;
    for (int i = 0; i < kRow; ++i) {
      is_near[i] = isNearSurface(view, voxels[row + i]);
      any |= is_near[i];
    }
    if (any == 0) continue;
    for (int i = 0; i < kRow; ++i) {
      near[count] = row + i;
      count += is_near[i];
    }
  }
  return count;
}

/// Lists the voxels of an array that are near their surface.
/// @return how many there are.
inline int listNearSurface(const PointView& view, const Voxel* voxels, int* near) {
  int count = 0;
  withWidestVectors([&] { count = listNear(view, voxels, near); });
  return count;
}

/// The points of some voxels of an array, found side by side; same bits as findSurfacePoint().
class PointBatch {
 public:
  static constexpr int kMost = 64;

  void find(const PointView& of_image, const Vec3f& of_block, const Voxel* voxels,
            const int* listed, int count, int direction) {
    for (int k = 0; k < count; ++k) {
      const int i = listed[k];
      slopes_.set(k, slopeAt(voxels, i));
      feet_.set(k, toFloat(voxelOffset(i)));
      sdf_[k] = sdfOf(voxels[i]);
    }
    withWidestVectors([&] { placeAll(of_image, of_block, direction, count); });
  }

  Vec3f normal(int k) const { return normals_[k]; }
  SurfacePoint point(int k) const { return points_[k]; }

 private:
  void placeAll(const PointView& of_image, const Vec3f& of_block, int direction, int count) {
    const FrameView frame = of_image.frame;  // copies of their own, which no result can overlap
    const Vec3f first_voxel_L = of_block;
    const Facing facing = facingOf(of_image.directional ? direction : kAnyDirection);
    for (int k = 0; k < count; ++k) {
      const Vec3f normal = gradientOf(slopes_[k], facing);
      normals_.set(k, normal);
      points_.set(k, placePoint(frame, first_voxel_L, feet_[k] - sdf_[k] * normal, normal));
    }
  }

  Columns<Vec3f, kMost> slopes_, feet_, normals_;
  Columns<SurfacePoint, kMost> points_;
  float sdf_[kMost];
};

constexpr int kCells = 8;  ///< That are drawn side by side.

inline void drawRows(const SurfacePiece* pieces, int count, int32_t width, float* hiding_m) {
  for (int i = 0; i < count; ++i) {
    const SurfacePiece piece = pieces[i];
    for (int32_t v = piece.first_v; v <= piece.last_v; ++v) {
      for (int32_t first = piece.first_u; first <= piece.last_u; first += kCells) {
        float* const cells = hiding_m + static_cast<size_t>(v) * width + first;
        for (int32_t k = 0; k < kCells; ++k) {
          const float nearer_m = minimum(cells[k], depthOfPiece(piece, first + k, v));
          cells[k] = first + k <= piece.last_u ? nearer_m : cells[k];
        }
      }
    }
  }
}

/// As drawSurface() of each. Cells up to kCells behind the image are read, and written as they are.
inline void drawPieces(const SurfacePiece* pieces, int count, int32_t width, float* hiding_m) {
  withWidestVectors([&] { drawRows(pieces, count, width, hiding_m); });
}

}  // namespace dtsdf
