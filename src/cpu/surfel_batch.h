/// Surfels made side by side.
#pragma once

#include <vector>

#include "cpu/columns.h"
#include "kernels/surfels/surfel.h"

namespace dtsdf {

/// Makes surfels of one frame; one per thread.
class SurfelBatch {
 public:
  /// Adds one. Those that were added before are appended to a list when there is no room for more.
  void add(const FrameView& frame, const SeenSurfel& seen, std::vector<Surfel>& surfels) {
    seen_.set(count_++, seen);
    if (count_ == kMost) finish(frame, surfels);
  }

  /// Appends those of the surfels that were added that have a weight; same bits as makeSurfel().
  void finish(const FrameView& frame, std::vector<Surfel>& surfels);

 private:
  static constexpr int kMost = 64;

  void make(const FrameView& frame);

  int count_ = 0;
  Columns<SeenSurfel, kMost> seen_;
  Columns<Surfel, kMost> made_;
};

}  // namespace dtsdf
