/// All cameras of the node, and the streams of images that each has.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "params/node_params.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_queue.h"
#include "ros/input/image_stream.h"
#include "ros/input/transforms.h"

namespace dtsdf {

/// Each camera of the setting `cameras` has its topics in its namespace; without that setting there
/// is one camera in the node's own. A camera is a stream of depth, and one of colour where that is
/// wanted. On the input's thread, but for report() and restartMotion().
class Cameras {
 public:
  /// Callbacks come by the queue of `nh`. The others outlive it.
  Cameras(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh, const NodeParams& params,
          Transforms& transforms, FrameQueue& queue);

  /// Images come from now on.
  void subscribe(const ros::NodeHandle& private_nh);

  /// Poses frames. Returns how long there will be nothing to do unless a message comes.
  std::chrono::milliseconds step() noexcept;

  /// See ImageStream::restartMotion().
  void restartMotion();

  /// In the order of the setting.
  std::vector<CameraReport> report() const;

 private:
  void add(const std::string& name, const std::string& ns, const ros::NodeHandle& nh,
           const NodeParams& params);
  void restartStamps(const ros::Time& stamp);

  Transforms& transforms_;
  FrameQueue& queue_;
  const ColourUse colour_;
  std::vector<std::string> names_;  ///< Of at least one camera; empty for the only one.
  /// Of each camera its depth, and its colour where that is wanted.
  std::vector<std::unique_ptr<ImageStream>> streams_;
};

}  // namespace dtsdf
