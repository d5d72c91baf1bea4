#include "ros/input/cameras.h"

#include <algorithm>
#include <string>
#include <utility>

namespace dtsdf {

std::string namespaceOf(const ros::NodeHandle& private_nh) {
  const std::string& name = private_nh.getNamespace();
  return name.substr(0, name.rfind('/'));
}

Cameras::Cameras(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                 const NodeParams& params, PoseSource& poses, FrameQueue& posed_frames,
                 std::function<void()> on_frame)
    : poses_(poses), posed_frames_(posed_frames) {
  const std::string ns = namespaceOf(private_nh);
  const Camera::Parts parts{poses, posed_frames, std::move(on_frame), [this] { startAnew(); }};
  for (const std::string& name : params.cameras) {
    cameras_.push_back(
        std::make_unique<Camera>(cameras_.size(), name, ns + "/" + name, nh, params, parts));
  }
  if (cameras_.empty()) {
    cameras_.push_back(std::make_unique<Camera>(0, "", ns, nh, params, parts));
  }
}

void Cameras::subscribe(const ros::NodeHandle& private_nh) {
  for (const auto& camera : cameras_) camera->subscribe(private_nh);
}

void Cameras::unsubscribe() {
  for (const auto& camera : cameras_) camera->unsubscribe();
}

std::chrono::milliseconds Cameras::step() noexcept {
  std::chrono::milliseconds idle = std::chrono::milliseconds::max();
  for (const auto& camera : cameras_) idle = std::min(idle, camera->step());
  return idle;
}

void Cameras::restartMotion() {
  for (const auto& camera : cameras_) camera->restartMotion();
}

void Cameras::setPaused(bool paused) {
  for (const auto& camera : cameras_) camera->setPaused(paused);
}

std::vector<CameraReport> Cameras::report() const {
  std::vector<CameraReport> reports;
  for (const auto& camera : cameras_) reports.push_back(camera->report());
  return reports;
}

void Cameras::startAnew() {
  for (const auto& camera : cameras_) camera->startAnew();
  posed_frames_.forgetStamps();
  // Under simulated time the listener has done so itself, and new transforms may be in by now.
  if (!ros::Time::isSimTime()) poses_.clear();
}

}  // namespace dtsdf
