#include "cpu/surface_points.h"

#include "cpu/voxel_row.h"
#include "cpu/widest_vectors.h"

namespace dtsdf {

void listNearSurface(const PointView& view, const Voxel* voxels, float distance, VoxelList& list) {
  const LaneInts too_little(view.least_evidence - 1);
  const LaneFloats most(distance);
  withWidestVectors([&] {
    int count = 0;
    for (int row = 0; row < kVoxelsPerBlock; row += kBlockSide) {
      const VoxelRow of_row(voxels + row);
      const LaneInts near = (of_row.evidence() > too_little) & (most >= magnitude(of_row.sdf()));
      if (!any(near)) continue;  // as most
      int32_t is_near[kLanes];
      near.store(is_near);
      for (int x = 0; x < kBlockSide; ++x) {
        list.index[count] = row + x;
        count -= is_near[x];
      }
    }
    list.count = count;
  });
}

void SurfacePoints::gather(const Voxel* voxels, const int* indices, int count) {
  for (int i = 0; i < count; ++i) {
    const Vec3f voxel = toFloat(voxelOffset(indices[i])), slope = slopeAt(voxels, indices[i]);
    x_[i] = voxel.x;
    y_[i] = voxel.y;
    z_[i] = voxel.z;
    sdf_[i] = sdfOf(voxels[indices[i]]);
    normal_x_[i] = slope.x;
    normal_y_[i] = slope.y;
    normal_z_[i] = slope.z;
  }
}

void SurfacePoints::findFeet(const PointView& view, int direction, int count) {
  const Facing facing = facingOf(view.directional ? direction : kAnyDirection);
  for (int i = 0; i < count; ++i) {
    const Vec3f normal = gradientOf({normal_x_[i], normal_y_[i], normal_z_[i]}, facing);
    const Vec3f foot = Vec3f{x_[i], y_[i], z_[i]} - sdf_[i] * normal;
    x_[i] = foot.x;
    y_[i] = foot.y;
    z_[i] = foot.z;
    normal_x_[i] = normal.x;
    normal_y_[i] = normal.y;
    normal_z_[i] = normal.z;
  }
}

int SurfacePoints::keepFacing(const PointView& view, int direction, const int* indices, int count) {
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3f normal{normal_x_[i], normal_y_[i], normal_z_[i]};
    index_[kept] = indices[i];
    x_[kept] = x_[i];
    y_[kept] = y_[i];
    z_[kept] = z_[i];
    normal_x_[kept] = normal.x;
    normal_y_[kept] = normal.y;
    normal_z_[kept] = normal.z;
    kept += static_cast<int>(hasPoint(view, normal, direction));
  }
  return kept;
}

void SurfacePoints::place(const FrameView& view, const Vec3f& first_voxel_L, int count) {
  const FrameView frame = view;  // copies of their own, which no result can overlap
  const Vec3f first = first_voxel_L;
  for (int i = 0; i < count; ++i) {
    const SurfacePoint point =
        placePoint(frame, first, {x_[i], y_[i], z_[i]}, {normal_x_[i], normal_y_[i], normal_z_[i]});
    depth_m_[i] = point.depth_m;
    cosine_[i] = point.cosine;
    u_[i] = point.u;
    v_[i] = point.v;
    inverse_depth_[i] = point.plane.inverse_depth;
    per_u_[i] = point.plane.per_u;
    per_v_[i] = point.plane.per_v;
  }
}

void SurfacePoints::keepThoseInImage(const PointView& view, int count) {
  count_ = 0;
  for (int i = 0; i < count; ++i) {
    const SurfacePoint seen = point(i);
    index_[count_] = index_[i];
    depth_m_[count_] = seen.depth_m;
    cosine_[count_] = seen.cosine;
    u_[count_] = seen.u;
    v_[count_] = seen.v;
    inverse_depth_[count_] = seen.plane.inverse_depth;
    per_u_[count_] = seen.plane.per_u;
    per_v_[count_] = seen.plane.per_v;
    count_ += static_cast<int>(isInImage(view, seen));
  }
}

void SurfacePoints::find(const PointView& view, const Vec3f& first_voxel_L, const Voxel* voxels,
                         int direction, const int* indices, int count) {
  gather(voxels, indices, count);
  findFeet(view, direction, count);
  const int kept = keepFacing(view, direction, indices, count);
  place(view.frame, first_voxel_L, kept);
  keepThoseInImage(view, kept);
}

}  // namespace dtsdf
