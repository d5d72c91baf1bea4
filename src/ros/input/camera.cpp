#include "ros/input/camera.h"

#include <utility>

namespace dtsdf {

Camera::Camera(std::string name, std::string ns, const ros::NodeHandle& nh,
               const InputParams& params, const Parts& parts)
    : name_(std::move(name)),
      ns_(std::move(ns)),
      nh_(nh),
      params_(params),
      on_frame_(parts.on_frame),
      accounting_(name_),
      intake_(params, {parts.poses, accounting_, parts.posed_frames,
                       parts.posed_frames.addStream({0, name_}), CameraInput::depthTopic(nh, ns_),
                       parts.on_time_jump}) {}

void Camera::subscribe(const ros::NodeHandle& private_nh) {
  input_ = std::make_unique<CameraInput>(nh_, private_nh, ns_, params_, accounting_,
                                         [this](const FrameMessages& frame) {
                                           intake_.push(frame);
                                           on_frame_();
                                         });
}

CameraReport Camera::report() const {
  StreamReport depth;
  depth.frames = accounting_.counts();
  depth.image_topic = input_->imageTopic();
  depth.info_topic = input_->infoTopic();
  depth.image_publishers = input_->imagePublishers();
  depth.waiting = intake_.size();
  depth.waiting_bytes = intake_.waitingBytes();
  depth.waiting_for = intake_.waitingFor();
  depth.warning = intake_.warning();
  return {name_, depth};
}

}  // namespace dtsdf
