#include "evaluation/parallel.h"

#include <mutex>

#include "program/progress_bar.h"
#include "threads/parallel.h"

namespace dtsdf {

void forEachImage(size_t count, const std::function<void(size_t)>& body) {
  ProgressBar progress("images", count);
  std::mutex mutex;  // guards `done` and `progress`
  size_t done = 0;
  parallelFor(count, 0, [&](size_t i) {
    body(i);
    const std::lock_guard<std::mutex> lock(mutex);
    progress.show(++done);
  });
}

}  // namespace dtsdf
