/// Time that blocks take in the parallel loop of a frame, split into its stages.
#pragma once

#include <atomic>
#include <chrono>

#include "backend/profile.h"

namespace dtsdf {

/// Splits the loop's wall time in the ratio of the times that its threads spend on each stage.
/// Reads no clock without a profile.
class BlockTimes {
 public:
  explicit BlockTimes(const Profile* profile) : enabled_(profile != nullptr) {
    if (enabled_) start_ = Clock::now();
  }

  void addTo(Profile* profile) const {
    if (!enabled_) return;
    const double wall_ms = std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
    double total_ns = 0.0;
    for (const std::atomic<int64_t>& ns : spent_ns_) total_ns += static_cast<double>(ns);
    for (int i = 0; i < kStages && total_ns > 0.0; ++i) {
      const double share = static_cast<double>(spent_ns_[i]) / total_ns;
      profile->add(static_cast<Stage>(kFirst + i), share * wall_ms);
    }
  }

  /// One block in the hands of one thread.
  class Lap {
   public:
    explicit Lap(BlockTimes& times) : times_(times) {
      if (times_.enabled_) last_ = Clock::now();
    }
    /// Ends one of the stages cast, fold and clear.
    void end(Stage stage) {
      if (!times_.enabled_) return;
      const auto now = Clock::now();
      times_.spent_ns_[static_cast<int>(stage) - kFirst] +=
          std::chrono::duration_cast<std::chrono::nanoseconds>(now - last_).count();
      last_ = now;
    }

   private:
    BlockTimes& times_;
    std::chrono::steady_clock::time_point last_;
  };

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr int kFirst = static_cast<int>(Stage::kCast);
  static constexpr int kStages = static_cast<int>(Stage::kClear) - kFirst + 1;
  const bool enabled_;
  Clock::time_point start_;
  std::atomic<int64_t> spent_ns_[kStages] = {};
};

}  // namespace dtsdf
