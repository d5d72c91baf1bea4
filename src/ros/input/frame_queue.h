/// The queue from the intake's thread to the map's: frames with their poses, in the order to fuse.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <ros/time.h>

#include <deque>
#include <functional>
#include <mutex>
#include <optional>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// A depth frame with what its pixels live in.
struct PosedFrame {
  ros::Time stamp;
  DepthFrame depth;
  cv_bridge::CvImageConstPtr pixels;
};

/// Thread safe. It is the intake that bounds it, together with the frames that have no pose yet.
class FrameQueue {
 public:
  /// `on_push` is called after each frame, by the thread that brought it.
  explicit FrameQueue(std::function<void()> on_push);

  void push(PosedFrame frame);

  /// The oldest frame. Does not wait.
  std::optional<PosedFrame> take();
  std::deque<PosedFrame> takeAll();

  size_t size() const;

 private:
  std::function<void()> on_push_;
  mutable std::mutex mutex_;
  std::deque<PosedFrame> frames_;
};

}  // namespace dtsdf
