/// The lines that surfels are cast along, computed side by side.
#pragma once

#include "kernels/fusion/cast.h"

namespace dtsdf {

/// Surfels of a stretch, and their lines; one per thread.
class LineBatch {
 public:
  bool isFull() const { return count_ == kMost; }
  int count() const { return count_; }
  void clear() { count_ = 0; }

  /// @pre it has a weight, and the batch is not full.
  void add(const Surfel& surfel, uint32_t number) {
    p_x_[count_] = surfel.p_L.x;
    p_y_[count_] = surfel.p_L.y;
    p_z_[count_] = surfel.p_L.z;
    normal_x_[count_] = surfel.normal_L.x;
    normal_y_[count_] = surfel.normal_L.y;
    normal_z_[count_] = surfel.normal_L.z;
    surfel_weight_[count_] = surfel.weight;
    depth_m_[count_] = surfel.depth_m;
    footprint_px_[count_] = surfel.footprint_px;
    numbers_[count_++] = number;
  }

  /// The lines of all that were added; same bits as makeCastLine(). In three loops over plain
  /// arrays, which compilers turn into vector instructions.
  void compute(const FrameSensing& sensing, const FusionSettings& fusion);

  uint32_t number(int i) const { return numbers_[i]; }
  CastLine line(int i) const;  ///< Without sides.
  MeasuredSides sides(int i, const FrameView& frame) const;

 private:
  Surfel surfelOf(int i) const;
  void computeWays(const FrameSensing& sensing, const FusionSettings& fusion);
  void computeLines();
  void computeDirections(bool directional);

  static constexpr int kMost = 64;

  int count_ = 0;
  uint32_t numbers_[kMost];
  float p_x_[kMost], p_y_[kMost], p_z_[kMost], normal_x_[kMost], normal_y_[kMost], normal_z_[kMost];
  float surfel_weight_[kMost], depth_m_[kMost];
  Footprint footprint_px_[kMost];
  float way_x_[kMost], way_y_[kMost], way_z_[kMost], reach_[kMost];
  int32_t axis_[kMost], first_plane_[kMost], last_plane_[kMost], direction_count_[kMost];
  float per_reach_[kMost], p_k_[kMost], p_u_[kMost], p_v_[kMost], slope_u_[kMost], slope_v_[kMost];
  float normal_k_[kMost], normal_u_[kMost], normal_v_[kMost];
  int32_t direction_[3][kMost];
  float weight_[3][kMost];
};

}  // namespace dtsdf
