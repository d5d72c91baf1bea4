#include "cpu/line_batch.h"

#include "cpu/widest_vectors.h"

namespace dtsdf {

inline Surfel LineBatch::surfelOf(int i) const {
  return {{p_x_[i], p_y_[i], p_z_[i]},
          surfel_weight_[i],
          {normal_x_[i], normal_y_[i], normal_z_[i]},
          depth_m_[i]};
}

inline void LineBatch::computeWays(const FrameSensing& sensing, const FusionSettings& fusion) {
  const int count = count_;
  for (int i = 0; i < count; ++i) {
    const CastWay way = castWayOf(surfelOf(i), sensing, fusion);
    way_x_[i] = way.direction.x;
    way_y_[i] = way.direction.y;
    way_z_[i] = way.direction.z;
    reach_[i] = way.reach;
  }
}

inline void LineBatch::computeLines() {
  const int count = count_;
  for (int i = 0; i < count; ++i) {
    const SampleLine line =
        sampleLineOf(surfelOf(i), {{way_x_[i], way_y_[i], way_z_[i]}, reach_[i]});
    axis_[i] = line.axis;
    first_plane_[i] = line.first_plane;
    last_plane_[i] = line.last_plane;
    per_reach_[i] = line.per_reach;
    p_k_[i] = line.p_k;
    p_u_[i] = line.p_u;
    p_v_[i] = line.p_v;
    slope_u_[i] = line.slope_u;
    slope_v_[i] = line.slope_v;
    normal_k_[i] = line.normal_k;
    normal_u_[i] = line.normal_u;
    normal_v_[i] = line.normal_v;
  }
}

inline void LineBatch::computeDirections(bool directional) {
  const int count = count_;
  for (int i = 0; i < count; ++i) {
    const DirectionSet directions = lineDirections(surfelOf(i), directional);
    direction_count_[i] = directions.count;
    for (int d = 0; d < 3; ++d) {
      direction_[d][i] = directions.direction[d];
      weight_[d][i] = directions.weight[d];
    }
  }
}

void LineBatch::compute(const FrameSensing& of_frame, const FusionSettings& of_fusion) {
  withWidestVectors([&] {
    const FrameSensing sensing = of_frame;  // copies of its own, which no result can overlap
    const FusionSettings fusion = of_fusion;
    computeWays(sensing, fusion);
    computeLines();
    computeDirections(fusion.directional != 0);
  });
}

MeasuredSides LineBatch::sides(int i, const FrameView& frame) const {
  Surfel surfel = surfelOf(i);
  surfel.footprint_px = footprint_px_[i];
  return measuredSides(surfel, frame, axis_[i]);
}

CastLine LineBatch::line(int i) const {
  return {{axis_[i], 0.0f, per_reach_[i], first_plane_[i], last_plane_[i], p_k_[i], p_u_[i],
           p_v_[i], slope_u_[i], slope_v_[i], normal_k_[i], normal_u_[i], normal_v_[i], noSides()},
          {direction_count_[i],
           {direction_[0][i], direction_[1][i], direction_[2][i]},
           {weight_[0][i], weight_[1][i], weight_[2][i]}}};
}

}  // namespace dtsdf
