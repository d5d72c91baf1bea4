/// What goes from the intake's thread to the map's: images with their poses, in the order to fuse
/// and to paint.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <ros/time.h>

#include <string>
#include <variant>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "ros/input/merge_queue.h"

namespace dtsdf {

/// Stamps that go back by more than this mean a new recording or a loop of it; less is disorder.
constexpr double kTimeJump_s = 0.5;

/// A frame with what its pixels live in.
struct PosedFrame {
  ros::Time stamp;
  std::variant<DepthFrame, ColourFrame> image;
  cv_bridge::CvImageConstPtr pixels;
  std::string frame_id;  ///< Of its camera.
  size_t camera = 0;     ///< Its place among the cameras.
  size_t stream = 0;     ///< Its number in the FrameQueue and the FrameLedger.
};

/// What the pixels of a frame take.
inline size_t bytesOf(const PosedFrame& frame) {
  return std::visit(
      [](const auto& image) { return image.row_bytes * static_cast<size_t>(image.height); },
      frame.image);
}

/// A stream for each camera's depth, and one for its colour. It is their intakes that bound it.
using FrameQueue = MergeQueue<PosedFrame>;

}  // namespace dtsdf
