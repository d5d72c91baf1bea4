/// The trajectory so far, in bounded memory.
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "io/trajectory.h"

namespace dtsdf {

/// Poses of frames that were fused; of more than `most` the oldest go.
class FusedPoses {
 public:
  static constexpr size_t kMost = 360000;  ///< Three hours of 30 images a second.

  explicit FusedPoses(size_t most = kMost) : most_(most) {}

  void add(const StampedPose& pose) {
    poses_.push_back(pose);
    if (poses_.size() <= most_) return;
    poses_.pop_front();
    ++left_out_;
  }

  void clear() {
    poses_.clear();
    left_out_ = 0;
  }

  std::vector<StampedPose> copy() const { return {poses_.begin(), poses_.end()}; }
  size_t leftOut() const { return left_out_; }
  size_t bytes() const { return poses_.size() * sizeof(StampedPose); }
  size_t maxBytes() const { return most_ * sizeof(StampedPose); }

 private:
  size_t most_;
  std::deque<StampedPose> poses_;
  size_t left_out_ = 0;
};

}  // namespace dtsdf
