/// Limits the rate of an image stream, based on stamps.
#pragma once

#include <limits>

namespace dtsdf {

/// Accepts at most a given number of images per second on average, judged by their stamps. An image
/// that is early by less than a tenth of the interval is still accepted. If a stamp is more than
/// two intervals before the time at which the next image is due, the limiter starts over.
class RateLimit {
 public:
  /// @param max_rate_hz Maximum rate, in images per second; 0: no limit.
  explicit RateLimit(double max_rate_hz) : interval_s_(max_rate_hz > 0 ? 1.0 / max_rate_hz : 0.0) {}

  /// Whether to accept the image with this stamp. Call this once per image, in order of arrival.
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
  /// When the next image is due. Initially infinity, so that the first image is accepted regardless
  /// of its stamp.
  double due_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace dtsdf
