#include "cpu/surfel_batch.h"

#include "cpu/widest_vectors.h"

namespace dtsdf {

inline void SurfelBatch::make(const FrameView& of_frame) {
  const FrameView frame = of_frame;  // a copy of its own, which no result can overlap
  const int count = count_;
  for (int i = 0; i < count; ++i) made_.set(i, makeSurfel(frame, seen_[i]));
}

void SurfelBatch::finish(const FrameView& frame, std::vector<Surfel>& surfels) {
  withWidestVectors([&] { make(frame); });
  for (int i = 0; i < count_; ++i) {
    const Surfel surfel = made_[i];
    if (surfel.weight > 0.0f) surfels.push_back(surfel);
  }
  count_ = 0;
}

}  // namespace dtsdf
