/// RAII wrappers of CUDA streams and events.
#pragma once

#include <utility>

#include "runtime/check.h"

namespace dtsdf {
namespace gpu {

/// A point in a stream's work. Waiting for an event that was never recorded returns at once.
class Event {
 public:
  /// @param flags cudaEventDefault for an event that records its time.
  explicit Event(unsigned flags = cudaEventDisableTiming) {
    DTSDF_CHECK_CUDA(cudaEventCreateWithFlags(&event_, flags));
  }
  ~Event() {
    if (event_ != nullptr) cudaEventDestroy(event_);
  }
  Event(Event&& other) noexcept : event_(other.event_) { other.event_ = nullptr; }
  Event& operator=(Event&& other) noexcept {
    std::swap(event_, other.event_);
    return *this;
  }

  cudaEvent_t get() const { return event_; }

  /// Blocks the calling thread until the work before the event is done.
  void wait() const { DTSDF_CHECK_CUDA(cudaEventSynchronize(event_)); }

  /// Time between two events that have completed and that record their times.
  float millisecondsSince(const Event& start) const {
    float elapsed_ms = 0.0f;
    DTSDF_CHECK_CUDA(cudaEventElapsedTime(&elapsed_ms, start.event_, event_));
    return elapsed_ms;
  }

 private:
  cudaEvent_t event_ = nullptr;
};

/// A CUDA stream that never synchronises with the default stream.
class Stream {
 public:
  Stream() {
    int device = 0, major = 0;
    DTSDF_CHECK_CUDA(cudaGetDevice(&device));
    DTSDF_CHECK_CUDA(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    starts_early_ = major >= 9;
    DTSDF_CHECK_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
  }
  ~Stream() {
    if (stream_ != nullptr) cudaStreamDestroy(stream_);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  cudaStream_t get() const { return stream_; }

  /// Whether the device can start a kernel before the previous one has ended.
  bool canOverlapKernels() const { return starts_early_; }

  void record(Event& event) const { DTSDF_CHECK_CUDA(cudaEventRecord(event.get(), stream_)); }

  /// Makes work enqueued from now on wait for the event. Does not block the calling thread.
  void waitFor(const Event& event) const {
    DTSDF_CHECK_CUDA(cudaStreamWaitEvent(stream_, event.get(), 0));
  }

  /// Blocks the calling thread until all enqueued work is done.
  void synchronize() const { DTSDF_CHECK_CUDA(cudaStreamSynchronize(stream_)); }

  /// Waits without checking for errors. For destructors, before they free memory that the work may
  /// use.
  void drain() const noexcept { cudaStreamSynchronize(stream_); }

 private:
  cudaStream_t stream_ = nullptr;
  bool starts_early_ = false;
};

}  // namespace gpu
}  // namespace dtsdf
