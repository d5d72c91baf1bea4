/// What goes from the intake's thread to the map's: frames with their poses, in the order to fuse.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <ros/time.h>

#include "dtsdf_mapping/depth_frame.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/merge_queue.h"

namespace dtsdf {

/// A depth frame with what its pixels live in.
struct PosedFrame {
  ros::Time stamp;
  DepthFrame depth;
  cv_bridge::CvImageConstPtr pixels;
  FrameAccounting* accounting = nullptr;  ///< Of its camera.
};

/// A stream for each camera. It is their intakes that bound it.
using FrameQueue = MergeQueue<PosedFrame>;

}  // namespace dtsdf
