/// Times stages on the device by events, for a profile; nothing is recorded without one.
#pragma once

#include <exception>
#include <vector>

#include "backend/profile.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

class StageClock {
 public:
  /// What is timed from now on is added to the profile; nullptr: nothing is.
  void profileTo(Profile* profile);
  Profile* profile() const { return profile_; }

  void begin(Stage stage, cudaStream_t stream);
  void end(cudaStream_t stream);

  /// Keeps the stream busy for some microseconds, so that launches that follow queue up and are
  /// timed back to back, without the time that the host takes to launch them.
  void hold(cudaStream_t stream);

  /// Adds all that was timed to the profile. @pre The work is done.
  void collect();

 private:
  struct Interval {
    Stage stage;
    Event begin{cudaEventDefault}, end{cudaEventDefault};
  };

  Profile* profile_ = nullptr;
  std::vector<Interval> intervals_;  ///< Kept for their events.
  size_t used_ = 0;
};

/// Times what is enqueued on a stream during its life, if the stream has a clock with a profile.
/// Spans do not nest.
class StageSpan {
 public:
  StageSpan(const Stream& stream, Stage stage) : stream_(stream) {
    if (isOn()) stream_.clock()->begin(stage, stream_.get());
  }
  ~StageSpan() {
    try {
      if (isOn()) stream_.clock()->end(stream_.get());
    } catch (const std::exception&) {  // shows in the next call of CUDA, outside of a destructor
    }
  }
  StageSpan(const StageSpan&) = delete;
  StageSpan& operator=(const StageSpan&) = delete;

 private:
  bool isOn() const { return stream_.clock() != nullptr && stream_.clock()->profile() != nullptr; }
  const Stream& stream_;
};

/// Lets what is enqueued next on the stream queue up, if it is profiled.
inline void holdForProfile(const Stream& stream) {
  if (stream.clock() != nullptr && stream.clock()->profile() != nullptr) {
    stream.clock()->hold(stream.get());
  }
}

inline Profile* profileOf(const Stream& stream) {
  return stream.clock() == nullptr ? nullptr : stream.clock()->profile();
}

}  // namespace gpu
}  // namespace dtsdf
