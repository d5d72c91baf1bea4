/// Time that blocks take in the parallel loop of a frame, split into casting and folding.
#pragma once

#include <atomic>
#include <chrono>

#include "backend/profile.h"
#include "map/block_table.h"

namespace dtsdf {

/// Splits the loop's wall time in the ratio of the times that its threads spend on either part.
/// Reads no clock without a profile.
class BlockTimes {
 public:
  explicit BlockTimes(const Profile* profile) : enabled_(profile != nullptr) {
    if (enabled_) start_ = Clock::now();
  }

  void addTo(Profile* profile) const {
    if (!enabled_) return;
    const double wall_ms =
        std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
    const double cast = static_cast<double>(cast_ns_), fold = static_cast<double>(fold_ns_);
    const double share = cast + fold > 0.0 ? cast / (cast + fold) : 1.0;
    profile->add(Stage::kCast, share * wall_ms);
    profile->add(Stage::kFold, (1.0 - share) * wall_ms);
    profile->work.touched_arrays += arrays_;
  }

  /// One block in the hands of one thread.
  class Lap {
   public:
    explicit Lap(BlockTimes& times) : times_(times) {
      if (times_.enabled_) last_ = Clock::now();
    }
    void endCast() {
      if (times_.enabled_) times_.cast_ns_ += split();
    }
    void endFold(const BlockEntry& block, uint32_t directions) {
      if (!times_.enabled_) return;
      times_.fold_ns_ += split();
      for (int d = 0; d < kDirectionCount; ++d) {
        times_.arrays_ += block.array[d] != kNoArray && (directions >> d & 1);
      }
    }

   private:
    int64_t split() {
      const auto now = Clock::now();
      const auto spent = std::chrono::duration_cast<std::chrono::nanoseconds>(now - last_).count();
      last_ = now;
      return spent;
    }
    BlockTimes& times_;
    std::chrono::steady_clock::time_point last_;
  };

 private:
  using Clock = std::chrono::steady_clock;
  const bool enabled_;
  Clock::time_point start_;
  std::atomic<int64_t> cast_ns_{0}, fold_ns_{0};
  std::atomic<uint64_t> arrays_{0};
};

}  // namespace dtsdf
