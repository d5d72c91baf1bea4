#include "ros/input/cameras.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <string>
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
    if (intake_.makeRoom()) continue;
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

namespace {

/// Of two images with one stamp the depth is fused first, so that there is something to paint.
constexpr int kDepthRank = 0, kColourRank = 1;

/// The colour camera's frame is that of its images, and masks are for depth.
InputParams colourInput(InputParams params) {
  params.camera_frame.clear();
  params.mask = false;
  return params;
}

}  // namespace

std::string namespaceOf(const ros::NodeHandle& private_nh) {
  const std::string& name = private_nh.getNamespace();
  return name.substr(0, name.rfind('/'));
}

Cameras::Cameras(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                 const NodeParams& params, Parts parts)
    : parts_(std::move(parts)), is_colour_needed_(params.colour.enabled == ColourUse::kAlways) {
  const std::string ns = namespaceOf(private_nh);
  for (const std::string& name : params.cameras) add(name, ns + "/" + name, nh, params);
  if (cameras_.empty()) add("", ns, nh, params);
}

void Cameras::add(const std::string& name, const std::string& ns, const ros::NodeHandle& nh,
                  const NodeParams& params) {
  Camera camera{name, makeDepth(name, ns, nh, params), nullptr};
  if (params.colour.enabled != ColourUse::kNever) camera.colour = makeColour(name, ns, nh, params);
  cameras_.push_back(std::move(camera));
}

std::unique_ptr<ImageStream> Cameras::makeDepth(const std::string& name, const std::string& ns,
                                                const ros::NodeHandle& nh,
                                                const NodeParams& params) {
  const auto stream = parts_.posed_frames.addStream({kDepthRank, name});
  parts_.ledger.addStream(stream, name);
  return std::make_unique<ImageStream>(
      ns, nh, params.input, makeDepthKind(params.input),
      FrameIntake::Parts{parts_.poses, parts_.posed_frames, parts_.ledger, stream, cameras_.size(),
                         [this] { restartStamps(); }},
      parts_.on_frame);
}

/// Colour whose stamps go back restarts alone: what is mapped does not depend on it.
std::unique_ptr<ImageStream> Cameras::makeColour(const std::string& name, const std::string& ns,
                                                 const ros::NodeHandle& nh,
                                                 const NodeParams& params) {
  const auto stream = parts_.posed_frames.addStream({kColourRank, name}, StreamUse::kExtra);
  parts_.ledger.addStream(stream, name.empty() ? "colour" : name + ", colour");
  return std::make_unique<ImageStream>(
      ns, nh, colourInput(params.input), makeColourKind(params.colour),
      FrameIntake::Parts{parts_.poses, parts_.posed_frames, parts_.ledger, stream, cameras_.size()},
      parts_.on_frame);
}

template <class Visit>
void Cameras::visitStreams(const Visit& visit) const {
  for (const Camera& camera : cameras_) {
    visit(*camera.depth);
    if (camera.colour) visit(*camera.colour);
  }
}

void Cameras::subscribe(const ros::NodeHandle& private_nh) {
  visitStreams([&](ImageStream& stream) { stream.subscribe(private_nh); });
}

void Cameras::unsubscribe() {
  visitStreams([](ImageStream& stream) { stream.unsubscribe(); });
}

std::chrono::milliseconds Cameras::step() noexcept {
  std::chrono::milliseconds idle = std::chrono::milliseconds::max();
  visitStreams([&](ImageStream& stream) { idle = std::min(idle, stream.intake().step()); });
  return idle;
}

void Cameras::restartMotion() {
  visitStreams([](ImageStream& stream) { stream.intake().restartMotion(); });
}

void Cameras::setPaused(bool paused) {
  visitStreams([&](ImageStream& stream) { stream.intake().setPaused(paused); });
}

std::vector<CameraReport> Cameras::report() const {
  std::vector<CameraReport> reports;
  for (const Camera& camera : cameras_) {
    CameraReport report;
    report.name = camera.name;
    report.depth = camera.depth->report();
    if (camera.colour) report.colour = camera.colour->report();
    report.is_colour_needed = is_colour_needed_;
    reports.push_back(std::move(report));
  }
  return reports;
}

void Cameras::restartStamps() {
  visitStreams([](ImageStream& stream) { stream.intake().restartStamps(); });
  parts_.posed_frames.forgetStamps();
  // Under simulated time the listener has done so itself, and new transforms may be in by now.
  if (!ros::Time::isSimTime()) parts_.poses.clear();
}

}  // namespace dtsdf
