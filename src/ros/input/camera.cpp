#include "ros/input/camera.h"

#include <algorithm>
#include <utility>

namespace dtsdf {
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

Camera::Camera(size_t place, std::string name, const std::string& ns, const ros::NodeHandle& nh,
               const NodeParams& params, const Parts& parts)
    : place_(place),
      name_(std::move(name)),
      is_colour_needed_(params.colour.enabled == ColourUse::kAlways),
      depth_(name_, ns, nh, params.input, {depthTopics(), makeDepthKind(params.input)},
             {parts.poses, parts.posed_frames, parts.posed_frames.addStream({kDepthRank, name_}),
              place_, parts.on_frame, parts.on_time_jump}),
      colour_(params.colour.enabled == ColourUse::kNever ? nullptr
                                                         : makeColour(ns, nh, params, parts)) {}

/// Colour whose stamps go back starts anew alone: what is mapped does not depend on it.
std::unique_ptr<ImageStream> Camera::makeColour(const std::string& ns, const ros::NodeHandle& nh,
                                                const NodeParams& params, const Parts& parts) {
  const auto stream =
      parts.posed_frames.addStream({kColourRank, name_}, StreamUse::kExtra);
  return std::make_unique<ImageStream>(
      name_.empty() ? "colour" : name_ + ", colour", ns, nh, colourInput(params.input),
      ImageStream::Kind{colourTopics(), makeColourKind(), params.colour.max_rate_hz},
      ImageStream::Parts{parts.poses, parts.posed_frames, stream, place_, parts.on_frame,
                         [this] { colour_->startAnew(); }});
}

void Camera::subscribe(const ros::NodeHandle& private_nh) {
  depth_.subscribe(private_nh);
  if (colour_) colour_->subscribe(private_nh);
}

void Camera::unsubscribe() {
  depth_.unsubscribe();
  if (colour_) colour_->unsubscribe();
}

std::chrono::milliseconds Camera::step() noexcept {
  const std::chrono::milliseconds idle = depth_.step();
  return colour_ ? std::min(idle, colour_->step()) : idle;
}

void Camera::startAnew() {
  depth_.startAnew();
  if (colour_) colour_->startAnew();
}

void Camera::restartMotion() {
  depth_.restartMotion();
  if (colour_) colour_->restartMotion();
}

void Camera::setPaused(bool paused) {
  depth_.setPaused(paused);
  if (colour_) colour_->setPaused(paused);
}

CameraReport Camera::report() const {
  CameraReport report;
  report.name = name_;
  report.depth = depth_.report();
  if (colour_) report.colour = colour_->report();
  report.is_colour_needed = is_colour_needed_;
  return report;
}

}  // namespace dtsdf
