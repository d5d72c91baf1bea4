#include "cpu/hiding_rows.h"

#include "cpu/lanes.h"
#include "cpu/widest_vectors.h"

namespace dtsdf {

/// A vector that begins in the last cell ends behind it.
HidingRows::HidingRows(std::vector<float>& depth_m, int32_t width, int32_t height) : width_(width) {
  depth_m.assign(static_cast<size_t>(width) * height + kLanes, kNoSurface_m);
  depth_m_ = depth_m.data();
}

void HidingRows::draw(const PointView& view, const SurfacePoints& points, const int* listed,
                      int count) const {
  SurfacePiece pieces[SurfacePoints::kMost];  // all first: what was just written is slow to read
  for (int i = 0; i < count; ++i) pieces[i] = pieceOf(view, points.point(listed[i]));
  withWidestVectors([&] {
    for (int i = 0; i < count; ++i) {
      const SurfacePiece& piece = pieces[i];
      const LaneFloats last_u(static_cast<float>(piece.last_u) + 0.5f);
      for (int32_t v = piece.first_v; v <= piece.last_v; ++v) {
        for (int32_t first = piece.first_u; first <= piece.last_u; first += kLanes) {
          const LaneFloats u = LaneFloats(static_cast<float>(first)) + laneNumbers();
          float* const cells = depth_m_ + static_cast<size_t>(v) * width_ + first;
          const LaneFloats before = LaneFloats::load(cells);
          const LaneFloats drawn = depthOfPiece(piece, u, v);
          select(u < last_u, minimum(before, drawn), before).store(cells);
        }
      }
    }
  });
}

}  // namespace dtsdf
