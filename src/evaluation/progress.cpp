#include "evaluation/progress.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>

namespace dtsdf {

std::function<void(size_t)> terminalProgress(const std::string& what, size_t total) {
  if (isatty(STDERR_FILENO) == 0) return {};
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto shown = std::make_shared<Clock::time_point>(start);
  return [=](size_t done) {
    const auto now = Clock::now();
    if (done < total && now - *shown < std::chrono::milliseconds(200)) return;
    *shown = now;
    const double spent_s = std::chrono::duration<double>(now - start).count();
    const double left_s = spent_s * static_cast<double>(total - done) / static_cast<double>(done);
    std::fprintf(stderr, "\r%s: %zu of %zu, %.0f s left ", what.c_str(), done, total, left_s);
    if (done >= total)
      std::fprintf(stderr, "\r%s: %zu in %.1f s        \n", what.c_str(), total, spent_s);
  };
}

}  // namespace dtsdf
