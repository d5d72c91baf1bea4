/// A progress bar on standard error, shown only on a terminal.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace dtsdf {

class ProgressBar {
 public:
  /// @param what What is counted, such as "frames". @param total Final count; none if unknown.
  ProgressBar(const std::string& what, std::optional<size_t> total);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Updates the bar to the count `done`. Redraws at most ten times a second.
  void show(size_t done);

 private:
  using Clock = std::chrono::steady_clock;

  const bool enabled_;
  const std::string what_;
  const std::optional<size_t> total_;
  const Clock::time_point start_;
  Clock::time_point last_drawn_;
  size_t drawn_length_ = 0;
};

/// The line to draw: bar, counts, rate and time left; only count and rate if the total is unknown.
std::string progressLine(const std::string& what, size_t done, std::optional<size_t> total,
                         double elapsed_s);

}  // namespace dtsdf
