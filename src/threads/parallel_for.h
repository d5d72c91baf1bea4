/// A parallel loop that lets exceptions through: one that left an OpenMP region would end the
/// process.
#pragma once

#include <omp.h>

#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>

namespace dtsdf {

/// Calls body(i, scratch) for each i below `count`, on up to `threads` threads, each with a Scratch
/// of its own. After an exception the rest is left out, and the first one is thrown to the caller.
/// A thread takes `kGrain` of them at a time: several where they are small. No other thread is
/// woken where one takes all.
template <class Scratch, size_t kGrain = 1, class Body>
void parallelFor(size_t count, int threads, const Body& body) {
  std::exception_ptr error;
  std::mutex mutex;
  bool failed = false;
#pragma omp parallel num_threads(threads) if (count > kGrain)
  {
    std::unique_ptr<Scratch> scratch;
#pragma omp for schedule(dynamic, kGrain)
    for (size_t i = 0; i < count; ++i) {
      bool stop;
#pragma omp atomic read
      stop = failed;
      if (stop) continue;
      try {
        if (scratch == nullptr) scratch = std::make_unique<Scratch>();
        body(i, *scratch);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (error == nullptr) error = std::current_exception();
#pragma omp atomic write
        failed = true;
      }
    }
  }
  if (error != nullptr) std::rethrow_exception(error);
}

}  // namespace dtsdf
