#include "ros/input/image_stream.h"

#include <exception>
#include <optional>
#include <utility>

#include "params/printable.h"

namespace dtsdf {

ImageStream::ImageStream(const std::string& ns, const ros::NodeHandle& nh,
                         const InputParams& params, ImageKind kind, const FrameIntake::Parts& parts,
                         std::function<void()> on_frame)
    : ns_(ns),
      nh_(nh),
      params_(params),
      kind_(std::move(kind)),
      on_frame_(std::move(on_frame)),
      rate_limit_(kind_.max_rate_hz),
      accounting_(parts.ledger.of(parts.stream)),
      intake_(params, parts, kind_, CameraInput::imageTopic(nh, ns, kind_)) {}

void ImageStream::subscribe(const ros::NodeHandle& private_nh) {
  input_ = std::make_unique<CameraInput>(
      kind_, nh_, private_nh, ns_, params_, accounting_,
      CameraInput::Handlers{[this](const FrameMessages& frame) { onFrame(frame); },
                            [this] { makeRoom(); }});
}

void ImageStream::onFrame(const FrameMessages& frame) {
  const ros::Time stamp = frame.image->header.stamp;
  if (!rate_limit_.takes(stamp.toSec())) {
    return accounting_.dropped(DropReason::kOverRate, stamp, "more than colour/max_rate_hz");
  }
  try {
    intake_.push(frame);
  } catch (const std::exception& error) {  // no memory for a masked copy
    accounting_.dropped(DropReason::kBadImage, stamp, errorText(error));
  }
  on_frame_();
}

/// Each of the two places keeps within the room; here they do so together.
void ImageStream::makeRoom() {
  for (;;) {
    const bool too_many =
        intake_.size() + input_->waitingImages() > static_cast<size_t>(params_.queue_size);
    const bool too_large = intake_.waitingBytes() + input_->waitingBytes() > queueBytesOf(params_);
    if (!too_many && !too_large) return;
    if (intake_.dropOne()) continue;
    const auto reason = too_many ? std::nullopt : std::optional<DropReason>(DropReason::kQueueFull);
    if (!input_->giveUpImage(reason)) return;
  }
}

StreamReport ImageStream::report() const {
  StreamReport report;
  report.frames = accounting_.counts();
  report.image_topic = input_->imageTopic();
  report.info_topic = input_->infoTopic();
  report.image_publishers = input_->imagePublishers();
  report.waiting = report.frames.waiting();
  report.waiting_bytes = intake_.waitingBytes() + input_->waitingBytes();
  report.waiting_for = intake_.waitingFor();
  if (report.waiting_for.empty()) report.waiting_for = input_->waitingFor();
  report.warning = intake_.warning();
  return report;
}

}  // namespace dtsdf
