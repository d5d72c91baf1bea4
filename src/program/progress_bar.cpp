#include "program/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "params/text.h"

namespace dtsdf {
namespace {

constexpr size_t kBarWidth = 30;
constexpr std::chrono::milliseconds kRedrawInterval{100};

}  // namespace

std::string progressLine(const std::string& what, size_t done, std::optional<size_t> total,
                         double elapsed_s) {
  const double rate = elapsed_s > 0.0 ? static_cast<double>(done) / elapsed_s : 0.0;
  if (!total || *total == 0) return formatted("%zu %s, %.1f/s", done, what.c_str(), rate);
  const size_t shown = std::min(done, *total);
  const size_t filled = kBarWidth * shown / *total;
  const std::string bar = std::string(filled, '=') + std::string(kBarWidth - filled, ' ');
  const double left_s = rate > 0.0 ? static_cast<double>(*total - shown) / rate : 0.0;
  return formatted("[%s] %3zu %%  %zu/%zu %s, %.1f/s, %.0f s left", bar.c_str(),
                   100 * shown / *total, done, *total, what.c_str(), rate, left_s);
}

ProgressBar::ProgressBar(const std::string& what, std::optional<size_t> total)
    : enabled_(isatty(STDERR_FILENO) == 1), what_(what), total_(total), start_(Clock::now()) {}

ProgressBar::~ProgressBar() {
  if (drawn_length_ > 0) std::fprintf(stderr, "\r%*s\r", static_cast<int>(drawn_length_), "");
}

void ProgressBar::show(size_t done) {
  const Clock::time_point now = Clock::now();
  if (!enabled_ || now - last_drawn_ < kRedrawInterval) return;
  last_drawn_ = now;
  const std::string line =
      progressLine(what_, done, total_, std::chrono::duration<double>(now - start_).count());
  // Blanks overwrite the rest of a longer previous line.
  const int width = static_cast<int>(std::max(drawn_length_, line.size()));
  std::fprintf(stderr, "\r%-*s", width, line.c_str());
  static_cast<void>(std::fflush(stderr));
  drawn_length_ = std::max(drawn_length_, line.size());
}

}  // namespace dtsdf
