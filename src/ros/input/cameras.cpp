#include "ros/input/cameras.h"

#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {
namespace {

/// How often a waiting frame asks for its transform.
constexpr std::chrono::milliseconds kTransformPoll{5};
/// A message wakes the thread.
constexpr std::chrono::milliseconds kUntilNextImage{1000};

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
                 const NodeParams& params, Transforms& transforms, FrameQueue& queue)
    : transforms_(transforms),
      queue_(queue),
      is_colour_needed_(params.colour.enabled == ColourUse::kAlways) {
  const std::string ns = namespaceOf(private_nh);
  for (const std::string& name : params.cameras) add(name, ns + "/" + name, nh, params);
  if (cameras_.empty()) add("", ns, nh, params);
}

void Cameras::add(const std::string& name, const std::string& ns, const ros::NodeHandle& nh,
                  const NodeParams& params) {
  Camera camera;
  camera.name = name;
  ImageStream::Parts parts{transforms_, queue_, frameOfPoses(params), cameras_.size(),
                           [this](const ros::Time& stamp) { restartStamps(stamp); }};
  camera.depth =
      std::make_unique<ImageStream>(makeDepthKind(params.input), name, ns, nh, params.input, parts);
  // Colour whose stamps go back restarts alone: what is mapped does not depend on it.
  parts.on_time_jump = nullptr;
  if (params.colour.enabled != ColourUse::kNever) {
    camera.colour = std::make_unique<ImageStream>(makeColourKind(params.colour), name, ns, nh,
                                                  colourInput(params.input), parts);
  }
  cameras_.push_back(std::move(camera));
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

std::chrono::milliseconds Cameras::step() noexcept {
  bool waits = false;
  guarded("input",
          [&] { visitStreams([&](ImageStream& stream) { waits = stream.step() || waits; }); });
  return waits ? kTransformPoll : kUntilNextImage;
}

void Cameras::restartMotion() {
  visitStreams([](ImageStream& stream) { stream.restartMotion(); });
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

void Cameras::restartStamps(const ros::Time& stamp) {
  visitStreams([&](ImageStream& stream) { stream.restartStamps(stamp); });
  queue_.forgetStamps();
  // Under simulated time it was done when the transforms came, and new ones may be in by now.
  if (!ros::Time::isSimTime()) transforms_.clear();
}

}  // namespace dtsdf
