/// Subscribes one kind of a camera's images and what belongs to them.
#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>

#include <functional>
#include <optional>
#include <string>

#include "ros/input/frame_accounting.h"
#include "ros/input/frame_assembly.h"
#include "ros/input/image_kind.h"

namespace dtsdf {

/// The topics of a kind and, unless it is remapped itself, the camera_info beside what that of the
/// images is remapped to; `mask/image` where masks are wanted. Images come by image_transport;
/// compressed ones for which there is no plugin are subscribed and decoded here.
class CameraInput {
 public:
  using OnFrame = FrameAssembly::OnComplete;

  /// Called on the callbacks' thread.
  struct Handlers {
    OnFrame on_frame;
    std::function<void()> on_waiting;  ///< More may wait than before: see waitingImages().
  };

  /// `kind` outlives it. `ns` is the namespace of the topics, empty for the root. Not that of `nh`,
  /// which for a nodelet of the root namespace is the one of its manager, such as a camera
  /// driver's.
  CameraInput(const ImageKind& kind, ros::NodeHandle nh, const ros::NodeHandle& private_nh,
              const std::string& ns, const InputParams& params, FrameAccounting& accounting,
              Handlers handlers);

  /// What the topic of a kind's images is remapped to.
  static std::string imageTopic(const ros::NodeHandle& nh, const std::string& ns,
                                const ImageKind& kind);

  std::string imageTopic() const;
  std::string infoTopic() const { return info_.getTopic(); }
  size_t imagePublishers() const;

  /// Images that wait for their camera_info or mask, and what they take with these.
  size_t waitingImages() const { return assembly_.waitingImages(); }
  size_t waitingBytes() const { return assembly_.waitingBytes(); }
  /// What they wait for, in words.
  std::string waitingFor() const;

  /// Callbacks' thread: see FrameAssembly::giveUpImage().
  bool giveUpImage(std::optional<DropReason> reason) { return assembly_.giveUpImage(reason); }

 private:
  void subscribeImages(ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                       const std::string& topic);
  bool decodesItself(const std::string& transport) const;
  void onCompressed(const sensor_msgs::CompressedImageConstPtr& message);
  void onImage(const sensor_msgs::ImageConstPtr& image);
  void onInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void onMask(const sensor_msgs::ImageConstPtr& mask);
  void onIncomplete(const sensor_msgs::Image& image, DropReason reason);
  std::string describeMissing(DropReason reason) const;

  const ImageKind& kind_;
  const CameraInfoChoice info_choice_;
  const size_t most_bytes_;  ///< That images may take.
  FrameAccounting& accounting_;
  std::function<void()> on_waiting_;
  FrameAssembly assembly_;
  image_transport::ImageTransport transport_;
  image_transport::Subscriber by_transport_;  ///< Images come by one of these two.
  ros::Subscriber compressed_;
  ros::Subscriber info_, mask_;
};

}  // namespace dtsdf
