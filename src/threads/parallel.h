/// Loops on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "threads/team.h"

namespace dtsdf {

/// Number of threads to use; one per core if `threads` is 0.
inline int threadCount(int threads) {
  if (threads > 0) return threads;
  return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

/// Calls body(i, scratch) for each i below `count`, on up to threadCount(threads) threads, each
/// with its own Scratch. After an exception no more indices are taken, and the first exception is
/// thrown to the caller. A thread takes `kGrain` indices at a time; use a larger value if the calls
/// are short. If `count` is at most `kGrain`, no other thread is woken.
template <class Scratch, size_t kGrain = 1, class Body>
void parallelFor(size_t count, int threads, const Body& body) {
  std::exception_ptr error;
  std::mutex mutex;
  // A range of indices that one thread processes first, so that successive loops process the same
  // indices on the same thread. After that, the thread helps with the other ranges.
  struct alignas(64) Stretch {
    std::atomic<size_t> next{0};
    size_t end = 0;
  };
  const size_t parts = (count + kGrain - 1) / kGrain;
  const size_t used = std::max<size_t>(1, std::min<size_t>(threadCount(threads), parts));
  std::vector<Stretch> stretches(used);
  for (size_t k = 0; k < used; ++k) {
    stretches[k].next = parts * k / used * kGrain;
    stretches[k].end = std::min(parts * (k + 1) / used * kGrain, count);
  }
  Team::own().run(used, [&](size_t number) {
    try {
      std::unique_ptr<Scratch> scratch;
      for (size_t k = 0; k < used; ++k) {
        Stretch& stretch = stretches[(number + k) % used];
        for (size_t first; (first = stretch.next.fetch_add(kGrain)) < stretch.end;) {
          if (scratch == nullptr) scratch = std::make_unique<Scratch>();
          const size_t end = std::min(first + kGrain, stretch.end);
          for (size_t i = first; i < end; ++i) body(i, *scratch);
        }
      }
    } catch (...) {
      for (Stretch& stretch : stretches) stretch.next = stretch.end;
      const std::lock_guard<std::mutex> lock(mutex);
      if (error == nullptr) error = std::current_exception();
    }
  });
  if (error != nullptr) std::rethrow_exception(error);
}

/// Calls body(i), without scratch, for each i below `count`.
template <size_t kGrain = 1, class Body>
void parallelFor(size_t count, int threads, const Body& body) {
  using NoScratch = char;
  parallelFor<NoScratch, kGrain>(count, threads, [&](size_t i, NoScratch&) { body(i); });
}

/// Calls make(i) for each i below `count` in parallel, and take(i, product) in order, one at a
/// time. At most one product per thread is kept. After an exception the remaining calls are
/// skipped, and the first exception is thrown to the caller.
template <class Make, class Take>
void makeInOrder(size_t count, int threads, const Make& make, const Take& take) {
  std::mutex mutex;
  std::condition_variable taken;
  size_t turn = 0;
  bool failed = false;
  std::atomic<size_t> next{0};
  const auto makeOne = [&](size_t i) {
    const auto product = make(i);
    std::unique_lock<std::mutex> lock(mutex);
    taken.wait(lock, [&] { return turn == i || failed; });
    if (failed) return;
    take(i, product);
    ++turn;
  };
  const size_t makers = std::min<size_t>(threadCount(threads), count);
  parallelFor(makers, static_cast<int>(makers), [&](size_t) {
    for (size_t i = next++; i < count; i = next++) {
      try {
        makeOne(i);
      } catch (...) {
        {
          const std::lock_guard<std::mutex> lock(mutex);
          failed = true;
        }
        next = count;
        taken.notify_all();
        throw;
      }
      taken.notify_all();
    }
  });
}

}  // namespace dtsdf
