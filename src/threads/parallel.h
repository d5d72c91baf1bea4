/// Work in parallel beside the frames: for files and copies, which want no pool of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace dtsdf {

/// As many threads as there are cores where 0 are asked for.
inline int threadCount(int threads) {
  if (threads > 0) return threads;
  return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

/// Calls body() on so many threads at once, the caller's being one of them; waits for all. The
/// first exception is thrown to the caller.
template <class Body>
void onThreads(int threads, const Body& body) {
  std::exception_ptr error;
  std::mutex mutex;
  const auto guarded = [&] {
    try {
      body();
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (error == nullptr) error = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  try {
    for (int i = 1; i < threads; ++i) others.emplace_back(guarded);
  } catch (const std::exception&) {  // no more threads to be had: those that are there do it
  }
  guarded();
  for (std::thread& other : others) other.join();
  if (error != nullptr) std::rethrow_exception(error);
}

/// Calls body(i) for each i below `count`. After an exception the rest is left out, and the first
/// one is thrown to the caller.
template <class Body>
void forEachInParallel(size_t count, int threads, const Body& body) {
  std::atomic<size_t> next{0};
  onThreads(static_cast<int>(std::min<size_t>(threadCount(threads), count)), [&] {
    for (size_t i = next++; i < count; i = next++) {
      try {
        body(i);
      } catch (...) {
        next = count;
        throw;
      }
    }
  });
}

/// Makes products 0 to count - 1 in parallel and hands them over in their order, one at a time:
/// make(i) gives a product, take(i, product) gets it. No more are kept than there are threads.
/// Exceptions as above.
template <class Make, class Take>
void makeInOrder(size_t count, int threads, const Make& make, const Take& take) {
  std::mutex mutex;
  std::condition_variable taken;
  size_t turn = 0;
  bool failed = false;
  forEachInParallel(count, threads, [&](size_t i) {
    try {
      const auto product = make(i);
      std::unique_lock<std::mutex> lock(mutex);
      taken.wait(lock, [&] { return turn == i || failed; });
      if (failed) return;
      take(i, product);
      ++turn;
    } catch (...) {
      {
        const std::lock_guard<std::mutex> lock(mutex);
        failed = true;
      }
      taken.notify_all();
      throw;
    }
    taken.notify_all();
  });
}

}  // namespace dtsdf
