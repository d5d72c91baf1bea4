/// Whether logged frames are fused again faster than new ones are added to the log.
#pragma once

#include <algorithm>

namespace dtsdf {

/// New frames go first, which leaves the others what time there is. Where that is too little to
/// ever end, two of the log go before each new one.
class CatchUp {
 public:
  /// A new frame is fused. @return whether it is now that the log falls too far behind.
  bool newFrame() {
    work_since_frame_ = 0;
    --lead_;
    const bool begins = !falls_behind_ && lead_ <= -kMostBehind;
    falls_behind_ = falls_behind_ || begins;  // for good, so that it is certain to end
    return begins;
  }

  /// It was the log's turn. @param has_fused Else it has waited for the disk, or ended.
  void turn(bool has_fused) {
    if (has_fused) lead_ = std::min(lead_ + 1, 0);
    work_since_frame_ += has_fused ? 2 : 1;
  }

  /// Whether the log's next turn is before the next new frame.
  bool isLogsTurn() const { return falls_behind_ && work_since_frame_ < kWorkPerFrame; }

 private:
  static constexpr int kMostBehind = 30;  ///< New frames more than those fused again meanwhile.
  static constexpr int kWorkPerFrame =
      4;  ///< Two frames, and time to see that these were the last.

  int lead_ = 0;
  int work_since_frame_ = 0;
  bool falls_behind_ = false;
};

}  // namespace dtsdf
