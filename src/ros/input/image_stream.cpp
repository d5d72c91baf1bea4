#include "ros/input/image_stream.h"

#include <utility>

namespace dtsdf {

ImageStream::ImageStream(const std::string& name, const std::string& ns, const ros::NodeHandle& nh,
                         const InputParams& params, Kind kind, const Parts& parts)
    : ns_(ns),
      nh_(nh),
      params_(params),
      kind_(std::move(kind)),
      on_frame_(parts.on_frame),
      rate_limit_(kind_.max_rate_hz),
      accounting_(name),
      intake_(params, {parts.poses, accounting_, parts.posed_frames, parts.stream, *kind_.images,
                       CameraInput::imageTopic(nh, ns, kind_.topics), parts.on_time_jump}) {}

void ImageStream::subscribe(const ros::NodeHandle& private_nh) {
  input_ = std::make_unique<CameraInput>(
      kind_.topics, nh_, private_nh, ns_, params_, accounting_,
      [this](const FrameMessages& frame) { onFrame(frame); });
}

void ImageStream::onFrame(const FrameMessages& frame) {
  const ros::Time stamp = frame.image->header.stamp;
  if (!rate_limit_.takes(stamp.toSec())) {
    return accounting_.dropped(DropReason::kOverRate, stamp, "more come than are wanted");
  }
  intake_.push(frame);
  on_frame_();
}

StreamReport ImageStream::report() const {
  StreamReport report;
  report.frames = accounting_.counts();
  report.image_topic = input_->imageTopic();
  report.info_topic = input_->infoTopic();
  report.image_publishers = input_->imagePublishers();
  report.waiting = intake_.size();
  report.waiting_bytes = intake_.waitingBytes();
  report.waiting_for = intake_.waitingFor();
  report.warning = intake_.warning();
  return report;
}

}  // namespace dtsdf
