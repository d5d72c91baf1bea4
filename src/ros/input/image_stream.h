/// One kind of a camera's images: its topics, what is checked when they come, their poses, and what
/// is fused of them.
#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "dtsdf_mapping/io/rate_limit.h"
#include "level/pose_convention.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_queue.h"
#include "ros/input/images.h"
#include "ros/input/pose_checks.h"
#include "ros/input/rectification.h"
#include "ros/input/transforms.h"

namespace dtsdf {

/// The topics of a kind and, unless it is remapped itself, the camera_info beside what that of the
/// images is remapped to; `mask/image` where masks are wanted. Images come by image_transport, but
/// compressed ones are subscribed and decoded here. On the input's thread, but for report() and
/// restartMotion().
class ImageStream {
 public:
  /// `name` is that of the camera, which is empty for a single one, and `camera` its place among
  /// them. `ns` is the namespace of the topics, empty for the root. Not that of `nh`, which for a
  /// nodelet of the root namespace is the one of its manager, such as a camera driver's.
  /// `on_time_jump` is called where stamps jump back; none: only this stream restarts. All that is
  /// given outlives it.
  ImageStream(const ImageKind& kind, const std::string& name, size_t camera, const std::string& ns,
              const ros::NodeHandle& nh, const NodeParams& params, Transforms& transforms,
              FrameQueue& queue, std::function<void(const ros::Time&)> on_time_jump = nullptr);

  /// Images come from now on.
  void subscribe(const ros::NodeHandle& private_nh);

  /// Poses the frames whose pose is known and drops those whose pose will not come. @return whether
  /// one waits for its pose.
  bool step();

  /// Stamps have jumped back to this one.
  void restartStamps(const ros::Time& stamp);
  /// The next pose may be anywhere, as after a map was loaded.
  void restartMotion() { is_motion_new_ = true; }

  StreamReport report() const;

 private:
  using Whole = FrameQueue::Whole;

  void onCompressed(const sensor_msgs::CompressedImageConstPtr& message);
  void onImage(const sensor_msgs::ImageConstPtr& image);
  void onInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void onMask(const sensor_msgs::ImageConstPtr& mask);
  std::string cameraFrame(const sensor_msgs::Image& image) const;
  FrameQueue::Decision decide(Whole& frame);
  std::optional<Rejection> check(const CameraImage& frame);
  bool handleTimeJump(const ros::Time& stamp);
  void endGap(const ros::Time& stamp);
  FrameQueue::Decision makePosed(const CameraImage& messages, const Eigen::Isometry3d& T_W_C);
  void noteDoubts(const PosedFrame& posed);

  const ImageKind& kind_;
  const std::string name_;  ///< Of the camera.
  const InputParams& params_;
  Transforms& transforms_;
  FrameQueue& queue_;
  const std::function<void(const ros::Time&)> on_time_jump_;
  const std::string pose_frame_;  ///< That poses are looked up in; empty: images have none.
  const size_t camera_;
  const bool is_needed_;
  ros::NodeHandle nh_;
  const std::string ns_, topic_;  ///< Of the images, before remapping.
  const std::string image_topic_, info_topic_;
  FrameAccounting accounting_;
  FrameQueue::Stream stream_;
  RateLimit rate_limit_;
  MotionGate motion_gate_;
  std::atomic<bool> is_motion_new_{false};
  Rectification rectification_;
  PoseConvention convention_;
  ros::Time last_stamp_, last_whole_;
  ros::Time ahead_stamp_;  ///< Of the last image, if far ahead of that; 0: it is not.

  mutable std::mutex mutex_;  ///< Guards the next one.
  std::string warning_;

  image_transport::ImageTransport transport_;
  image_transport::Subscriber by_transport_;  ///< Images come by one of these two.
  ros::Subscriber compressed_;
  ros::Subscriber info_, mask_;
};

}  // namespace dtsdf
