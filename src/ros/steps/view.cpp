/// The step that publishes the map as a depth image from the camera's pose, while someone listens.
#include <cv_bridge/cv_bridge.h>
#include <image_transport/image_transport.h>
#include <ros/console.h>
#include <sensor_msgs/image_encodings.h>

#include <exception>
#include <limits>

#include "dtsdf_mapping/rendered_view.h"
#include "params/printable.h"
#include "ros/input/images.h"
#include "ros/steps/live_map.h"
#include "ros/steps/make_steps.h"

namespace dtsdf {
namespace {

constexpr double kMaxViews_hz = 5.0;
/// After rendering a view, the map thread fuses frames for at least this multiple of the rendering
/// time.
constexpr int kFramesPerView = 4;

/// A depth image as in REP 118: metres, and NaN where there is no surface.
sensor_msgs::ImagePtr imageOf(const std_msgs::Header& header, RenderedView view) {
  for (float& depth : view.depth_m) {
    if (!(depth > 0.0f)) depth = std::numeric_limits<float>::quiet_NaN();
  }
  const cv::Mat depth_m(view.height, view.width, CV_32FC1, view.depth_m.data());
  return cv_bridge::CvImage(header, sensor_msgs::image_encodings::TYPE_32FC1, depth_m).toImageMsg();
}

class ViewStep : public Step {
 public:
  explicit ViewStep(const Host& host) : host_(host), pace_(kMaxViews_hz) {}

  void advertise(const Handles& handles) override {
    images_ = image_transport::ImageTransport(handles.prompt).advertiseCamera("rendered/image", 1);
  }

  /// Renders the map from the pose of the frame.
  void fused(const PosedFrame& frame, const IntegrationResult& result) override {
    const auto* const depth = std::get_if<DepthFrame>(&frame.image);
    const SteadyTime begin = std::chrono::steady_clock::now();
    if (depth == nullptr || result.status != FrameStatus::kFused) return;
    if (images_.getNumSubscribers() == 0 || !pace_.isDue(begin)) return;
    const RenderCamera camera{depth->width, depth->height, depth->intrinsics};
    try {
      host_.map.mapper().render(camera, depth->T_W_C, view_);
    } catch (const std::exception& error) {  // only warns: fusing reports a lost GPU
      ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                     "no image on rendered/image: " << errorText(error));
      return;
    }
    std_msgs::Header header;
    header.stamp = frame.stamp;
    header.frame_id = frame.frame_id;
    const sensor_msgs::ImagePtr image = imageOf(header, view_);
    images_.publish(*image, makeCameraInfo(*image, camera.intrinsics));
    pace_.end(begin, kFramesPerView);
  }

 private:
  const Host& host_;
  Pace pace_;
  RenderedView view_;
  image_transport::CameraPublisher images_;
};

}  // namespace

std::unique_ptr<Step> makeViewStep(const Host& host) { return std::make_unique<ViewStep>(host); }

}  // namespace dtsdf
