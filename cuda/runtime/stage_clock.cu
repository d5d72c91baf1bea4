#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Some 60 microseconds at the clocks of today's devices.
constexpr long long kHoldCycles = 100000;

__global__ void holdKernel() {
  const long long start = clock64();
  while (clock64() - start < kHoldCycles) {
  }
}

}  // namespace

void StageClock::profileTo(Profile* profile) {
  profile_ = profile;
  used_ = 0;
}

void StageClock::begin(Stage stage, cudaStream_t stream) {
  if (used_ == intervals_.size()) intervals_.emplace_back();
  intervals_[used_].stage = stage;
  DTSDF_CHECK_CUDA(cudaEventRecord(intervals_[used_].begin.get(), stream));
}

void StageClock::end(cudaStream_t stream) {
  DTSDF_CHECK_CUDA(cudaEventRecord(intervals_[used_].end.get(), stream));
  ++used_;
}

void StageClock::hold(cudaStream_t stream) {
  holdKernel<<<1, 1, 0, stream>>>();
  checkLaunch("holdKernel");
}

void StageClock::collect() {
  for (size_t i = 0; i < used_ && profile_ != nullptr; ++i) {
    profile_->add(intervals_[i].stage, intervals_[i].end.millisecondsSince(intervals_[i].begin));
  }
  used_ = 0;
}

}  // namespace gpu
}  // namespace dtsdf
