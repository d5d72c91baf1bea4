/// The points of an array's surface, found side by side: findSurfacePoint() in steps that compilers
/// turn into vector instructions. Same bits.
#pragma once

#include <algorithm>

#include "kernels/colour/surface_point.h"

namespace dtsdf {

/// Some voxels of an array.
struct VoxelList {
  int count = 0;
  int index[kVoxelsPerBlock];
};

/// Lists those that are known and so near to their surface.
void listNearSurface(const PointView& view, const Voxel* voxels, float distance, VoxelList& list);

/// The points of up to kMost voxels.
class SurfacePoints {
 public:
  static constexpr int kMost = 64;

  /// Those of the voxels that have one in the image.
  void find(const PointView& view, const Vec3f& first_voxel_L, const Voxel* voxels, int direction,
            const int* indices, int count);

  int count() const { return count_; }
  int index(int i) const { return index_[i]; }
  SurfacePoint point(int i) const {
    return {depth_m_[i], cosine_[i], u_[i], v_[i], {inverse_depth_[i], per_u_[i], per_v_[i]}};
  }

 private:
  void gather(const Voxel* voxels, const int* indices, int count);
  void findFeet(const PointView& view, int direction, int count);
  int keepFacing(const PointView& view, int direction, const int* indices, int count);
  void place(const FrameView& view, const Vec3f& first_voxel_L, int count);
  void keepThoseInImage(const PointView& view, int count);

  int count_ = 0;
  int index_[kMost];
  float x_[kMost], y_[kMost], z_[kMost];  ///< Of the voxel, then of its foot.
  float sdf_[kMost];
  float normal_x_[kMost], normal_y_[kMost], normal_z_[kMost];  ///< The slopes, first.
  float depth_m_[kMost], cosine_[kMost], u_[kMost], v_[kMost];
  float inverse_depth_[kMost], per_u_[kMost], per_v_[kMost];
};

}  // namespace dtsdf
