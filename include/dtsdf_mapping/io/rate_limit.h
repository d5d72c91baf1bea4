/// Thins out a stream of images by their stamps.
#pragma once

#include <limits>

namespace dtsdf {

/// Decides from stamps which images of a stream are taken: on average, at most a given number per
/// second. An image that is early by less than a tenth of the interval is still taken. If a stamp
/// is more than two intervals before the next image is due, the limit starts over.
class RateLimit {
 public:
  /// @param max_rate_hz Images per second; 0: all are taken.
  explicit RateLimit(double max_rate_hz) : interval_s_(max_rate_hz > 0 ? 1.0 / max_rate_hz : 0.0) {}

  /// Whether the image with this stamp is taken. Call it once per image, in order of arrival.
  bool takes(double stamp_s) {
    if (interval_s_ <= 0.0) return true;
    const bool begins_anew = stamp_s < due_s_ - 2.0 * interval_s_;
    if (!begins_anew && stamp_s < due_s_ - 0.1 * interval_s_) return false;
    const bool is_regular = !begins_anew && stamp_s < due_s_ + interval_s_;
    due_s_ = (is_regular ? due_s_ : stamp_s) + interval_s_;
    return true;
  }

 private:
  double interval_s_;
  /// When the next image is due. At first infinity, so that the first image is taken, whatever its
  /// stamp.
  double due_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace dtsdf
