#include "cpu/surface_points.h"

#include "cpu/voxel_row.h"
#include "cpu/widest_vectors.h"

namespace dtsdf {

void listNearSurface(const PointView& view, const Voxel* voxels, float distance, VoxelList& list) {
  // In whole units, the same comparisons.
  const int32_t most_units = floorToInt(minimum(distance * kStoredSdfScale, 32768.0f));
  const LaneInts too_little(view.least_evidence - 1), too_low(-most_units - 1),
      too_high(most_units + 1);
  const auto nearIn = [&](int row) {
    const VoxelRow of_row(voxels + row);
    return (of_row.evidence() > too_little) & (of_row.sdf_units > too_low) &
           (too_high > of_row.sdf_units);
  };
  withWidestVectors([&] {
    constexpr int kRows = 2;  // so many are asked at once, as most have none
    int count = 0;
    for (int first = 0; first < kVoxelsPerBlock; first += kRows * kBlockSide) {
      const LaneInts near[kRows] = {nearIn(first), nearIn(first + kBlockSide)};
      if (!any(near[0] | near[1])) continue;
      int32_t is_near[kRows * kLanes];
      for (int row = 0; row < kRows; ++row) near[row].store(is_near + row * kLanes);
      for (int i = 0; i < kRows * kLanes; ++i) {
        list.index[count] = first + i;
        count -= is_near[i];
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

inline void SurfacePoints::findFeet(const PointView& view, int direction, int count) {
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

inline int SurfacePoints::keepFacing(const PointView& view, int direction, const int* indices,
                                     int count) {
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

inline void SurfacePoints::place(const FrameView& view, const Vec3f& first_voxel_L, int count) {
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

inline void SurfacePoints::keepThoseInImage(const PointView& view, int count) {
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
  withWidestVectors([&] {
    findFeet(view, direction, count);
    const int kept = keepFacing(view, direction, indices, count);
    place(view.frame, first_voxel_L, kept);
    keepThoseInImage(view, kept);
  });
}

}  // namespace dtsdf
