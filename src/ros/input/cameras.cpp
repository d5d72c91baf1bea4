#include "ros/input/cameras.h"

#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {
namespace {

/// How often a waiting frame asks for its transform.
constexpr std::chrono::milliseconds kTransformPoll{5};
/// A message wakes the thread.
constexpr std::chrono::milliseconds kUntilNextImage{1000};

}  // namespace

Cameras::Cameras(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                 const NodeParams& params, Transforms& transforms, FrameQueue& queue)
    : transforms_(transforms), queue_(queue), colour_(params.colour.enabled) {
  // That of the node, which its topics are in; empty for the root.
  const std::string& node = private_nh.getNamespace();
  const std::string ns = node.substr(0, node.rfind('/'));
  for (const std::string& name : params.cameras) add(name, ns + "/" + name, nh, params);
  if (names_.empty()) add("", ns, nh, params);
}

void Cameras::add(const std::string& name, const std::string& ns, const ros::NodeHandle& nh,
                  const NodeParams& params) {
  const size_t camera = names_.size();
  names_.push_back(name);
  streams_.push_back(
      std::make_unique<ImageStream>(kDepthImages, name, camera, ns, nh, params, transforms_, queue_,
                                    [this](const ros::Time& stamp) { restartStamps(stamp); }));
  if (colour_ == ColourUse::kNever) return;
  // Colour whose stamps go back restarts alone: what is mapped does not depend on it.
  streams_.push_back(std::make_unique<ImageStream>(kColourImages, name, camera, ns, nh, params,
                                                   transforms_, queue_));
}

void Cameras::subscribe(const ros::NodeHandle& private_nh) {
  for (const auto& stream : streams_) stream->subscribe(private_nh);
}

std::chrono::milliseconds Cameras::step() noexcept {
  bool waits = false;
  guarded("input", [&] {
    for (const auto& stream : streams_) waits = stream->step() || waits;
  });
  return waits ? kTransformPoll : kUntilNextImage;
}

void Cameras::restartMotion() {
  for (const auto& stream : streams_) stream->restartMotion();
}

std::vector<CameraReport> Cameras::report() const {
  std::vector<CameraReport> reports;
  auto stream = streams_.begin();
  for (const std::string& name : names_) {
    CameraReport report;
    report.name = name;
    report.depth = (*stream++)->report();
    if (colour_ != ColourUse::kNever) report.colour = (*stream++)->report();
    report.is_colour_needed = colour_ == ColourUse::kAlways;
    reports.push_back(std::move(report));
  }
  return reports;
}

void Cameras::restartStamps(const ros::Time& stamp) {
  for (const auto& stream : streams_) stream->restartStamps(stamp);
  // Under simulated time it was done when the transforms came, and new ones may be in by now.
  if (!ros::Time::isSimTime()) transforms_.clear();
}

}  // namespace dtsdf
