#include "ros/input/frame_queue.h"

#include <utility>

namespace dtsdf {

FrameQueue::FrameQueue(std::function<void()> on_push) : on_push_(std::move(on_push)) {}

void FrameQueue::push(PosedFrame frame) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    frames_.push_back(std::move(frame));
  }
  on_push_();
}

std::optional<PosedFrame> FrameQueue::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (frames_.empty()) return std::nullopt;
  PosedFrame frame = std::move(frames_.front());
  frames_.pop_front();
  return frame;
}

std::deque<PosedFrame> FrameQueue::takeAll() {
  std::deque<PosedFrame> frames;
  const std::lock_guard<std::mutex> lock(mutex_);
  frames.swap(frames_);
  return frames;
}

size_t FrameQueue::size() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return frames_.size();
}

}  // namespace dtsdf
