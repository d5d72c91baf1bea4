/// The lines that surfels are cast along, computed side by side.
#pragma once

#include "cpu/columns.h"
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
    surfels_.set(count_, surfel);
    numbers_[count_++] = number;
  }

  /// The lines of all that were added; same bits as makeCastLine(). In three loops, which compilers
  /// turn into vector instructions.
  void compute(const FrameSensing& sensing, const FusionSettings& fusion);

  uint32_t number(int i) const { return numbers_[i]; }
  CastLine line(int i, const FrameView& frame) const {
    const SampleLine line = lines_[i];
    return {line, measuredSides(surfels_[i], frame, line.axis), directions_[i]};
  }

 private:
  void computeAll(const FrameSensing& sensing, const FusionSettings& fusion);

  static constexpr int kMost = 64;

  int count_ = 0;
  uint32_t numbers_[kMost];
  Columns<Surfel, kMost> surfels_;
  Columns<CastWay, kMost> ways_;
  Columns<SampleLine, kMost> lines_;
  Columns<DirectionSet, kMost> directions_;
};

}  // namespace dtsdf
