/// A parallel loop over what is small, for the stages of a frame.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <vector>

#include "threads/team.h"

namespace dtsdf {

/// Numbers below `count` as threads take them: each from a stretch of its own, so that it comes to
/// the same rows in one loop after the other, and then from those of others.
class SharedCount {
 public:
  SharedCount(size_t count, size_t threads, size_t grain) : stretches_(threads), grain_(grain) {
    const size_t parts = (count + grain - 1) / grain;
    for (size_t k = 0; k < threads; ++k) {
      stretches_[k].next = parts * k / threads * grain;
      stretches_[k].end = std::min(parts * (k + 1) / threads * grain, count);
    }
  }

  /// Calls visit(first, end) for what thread `number` takes.
  template <class Visit>
  void visit(size_t number, const Visit& visit) {
    for (size_t k = 0; k < stretches_.size(); ++k) {
      Stretch& stretch = stretches_[(number + k) % stretches_.size()];
      for (;;) {
        const size_t first = stretch.next.fetch_add(grain_);
        if (first >= stretch.end) break;
        visit(first, std::min(first + grain_, stretch.end));
      }
    }
  }

  /// Leaves out what was not taken yet.
  void stop() {
    for (Stretch& stretch : stretches_) stretch.next = stretch.end;
  }

 private:
  struct alignas(64) Stretch {
    std::atomic<size_t> next{0};
    size_t end = 0;
  };
  std::vector<Stretch> stretches_;
  const size_t grain_;
};

/// Of a loop whose threads keep nothing from one number to the next.
struct NoScratch {};

/// Calls body(i, scratch) for each i below `count`, on up to `threads` threads, each with a Scratch
/// of its own. After an exception the rest is left out, and the first one is thrown to the caller.
/// A thread takes `kGrain` of them at a time: several where they are small. No other thread is
/// woken where one takes all, and none is waited for that comes when all are taken.
template <class Scratch, size_t kGrain = 1, class Body>
void parallelFor(size_t count, int threads, const Body& body) {
  std::exception_ptr error;
  std::mutex mutex;
  const size_t parts = (count + kGrain - 1) / kGrain;
  const size_t used = std::max<size_t>(1, std::min<size_t>(std::max(threads, 1), parts));
  SharedCount shared(count, used, kGrain);
  Team::own().run(used, [&](size_t number) {
    try {
      std::unique_ptr<Scratch> scratch;
      shared.visit(number, [&](size_t first, size_t end) {
        if (scratch == nullptr) scratch = std::make_unique<Scratch>();
        for (size_t i = first; i < end; ++i) body(i, *scratch);
      });
    } catch (...) {
      shared.stop();
      const std::lock_guard<std::mutex> lock(mutex);
      if (error == nullptr) error = std::current_exception();
    }
  });
  if (error != nullptr) std::rethrow_exception(error);
}

}  // namespace dtsdf
