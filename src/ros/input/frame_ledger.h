/// What became of every frame of the node, stream by stream.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "ros/input/frame_accounting.h"

namespace dtsdf {

/// Beside the way of the frames: whoever drops or fuses one finds its stream's accounting here.
/// Streams are added before frames come; then it is thread safe.
class FrameLedger {
 public:
  explicit FrameLedger(SteadyClock clock = std::chrono::steady_clock::now)
      : clock_(std::move(clock)) {}

  /// `stream` is its number in the FrameQueue; `name` begins its warnings.
  FrameAccounting& addStream(size_t stream, const std::string& name = "") {
    return streams_.try_emplace(stream, name, clock_).first->second;
  }

  FrameAccounting& of(size_t stream) { return streams_.at(stream); }

 private:
  const SteadyClock clock_;
  std::map<size_t, FrameAccounting> streams_;
};

}  // namespace dtsdf
