#include "cpu/line_batch.h"

#include "cpu/widest_vectors.h"

namespace dtsdf {

inline void LineBatch::computeAll(const FrameSensing& of_frame, const FusionSettings& of_fusion) {
  const FrameSensing sensing = of_frame;  // copies of its own, which no result can overlap
  const FusionSettings fusion = of_fusion;
  const int count = count_;
  for (int i = 0; i < count; ++i) ways_.set(i, castWayOf(surfels_[i], sensing, fusion));
  for (int i = 0; i < count; ++i) lines_.set(i, sampleLineOf(surfels_[i], ways_[i]));
  const bool directional = fusion.directional != 0;
  for (int i = 0; i < count; ++i) directions_.set(i, lineDirections(surfels_[i], directional));
}

void LineBatch::compute(const FrameSensing& sensing, const FusionSettings& fusion) {
  withWidestVectors([&] { computeAll(sensing, fusion); });
}

}  // namespace dtsdf
