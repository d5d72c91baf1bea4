#include "evaluation/parallel.h"

#include <algorithm>
#include <mutex>

#include "program/progress_bar.h"
#include "threads/parallel.h"

namespace dtsdf {

void forEachIndex(size_t count, const std::function<void(size_t)>& body,
                  const std::function<void(size_t)>& progress) {
  const size_t chunk = 1 + count / 4096;
  std::mutex mutex;  // guards done and the progress callback
  size_t done = 0;
  parallelFor((count + chunk - 1) / chunk, 0, [&](size_t i) {
    const size_t begin = i * chunk, end = std::min(begin + chunk, count);
    for (size_t index = begin; index < end; ++index) body(index);
    if (!progress) return;
    const std::lock_guard<std::mutex> lock(mutex);
    done += end - begin;
    progress(done);
  });
}

void forEachImage(size_t count, const std::function<void(size_t)>& body) {
  ProgressBar progress("images", count);
  forEachIndex(count, body, [&](size_t done) { progress.show(done); });
}

}  // namespace dtsdf
