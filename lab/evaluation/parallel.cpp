#include "evaluation/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "program/progress_bar.h"

namespace dtsdf {

void parallelFor(size_t count, size_t chunk, const std::function<void(size_t, size_t)>& body,
                 const std::function<void(size_t)>& progress) {
  std::atomic<size_t> next{0};
  std::mutex mutex;  // guards done, failure and the progress callback
  size_t done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    for (size_t begin = next.fetch_add(chunk); begin < count; begin = next.fetch_add(chunk)) {
      const size_t end = std::min(begin + chunk, count);
      try {
        body(begin, end);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
        return;
      }
      if (!progress) continue;
      const std::lock_guard<std::mutex> lock(mutex);
      done += end - begin;
      progress(done);
    }
  };
  std::vector<std::thread> helpers;
  const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  for (unsigned i = 1; i < threads; ++i) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
}

void forEachImage(size_t count, const std::function<void(size_t)>& body) {
  ProgressBar progress("images", count);
  parallelFor(
      count, 1, [&](size_t index, size_t) { body(index); },
      [&](size_t done) { progress.show(done); });
}

}  // namespace dtsdf
