#include "evaluation/parallel.h"

#include <algorithm>
#include <mutex>

#include "program/progress_bar.h"
#include "threads/parallel.h"

namespace dtsdf {

void forEachChunk(size_t count, size_t chunk, const std::function<void(size_t, size_t)>& body,
                  const std::function<void(size_t)>& progress) {
  std::mutex mutex;  // guards done and the progress callback
  size_t done = 0;
  forEachInParallel((count + chunk - 1) / chunk, 0, [&](size_t i) {
    const size_t begin = i * chunk, end = std::min(begin + chunk, count);
    body(begin, end);
    if (!progress) return;
    const std::lock_guard<std::mutex> lock(mutex);
    done += end - begin;
    progress(done);
  });
}

void forEachImage(size_t count, const std::function<void(size_t)>& body) {
  ProgressBar progress("images", count);
  forEachChunk(
      count, 1, [&](size_t index, size_t) { body(index); },
      [&](size_t done) { progress.show(done); });
}

}  // namespace dtsdf
