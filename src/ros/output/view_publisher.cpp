#include "ros/output/view_publisher.h"

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>

#include <limits>
#include <utility>

#include "ros/input/images.h"

namespace dtsdf {
namespace {

constexpr double kMostViews_hz = 5.0;
/// Of the map's time frames get at least so many times as much as views.
constexpr int kFramesPerView = 4;

/// As REP 118 has it: metres, and NaN where there is no surface.
sensor_msgs::ImagePtr imageOf(const std_msgs::Header& header, RenderedView view) {
  for (float& depth : view.depth_m) {
    if (!(depth > 0.0f)) depth = std::numeric_limits<float>::quiet_NaN();
  }
  const cv::Mat depth_m(view.height, view.width, CV_32FC1, view.depth_m.data());
  return cv_bridge::CvImage(header, sensor_msgs::image_encodings::TYPE_32FC1, depth_m).toImageMsg();
}

}  // namespace

ViewPublisher::ViewPublisher(ros::NodeHandle private_nh, SteadyClock clock)
    : clock_(std::move(clock)),
      pace_(kMostViews_hz),
      images_(private_nh.advertise<sensor_msgs::Image>("rendered/image", 1)),
      infos_(private_nh.advertise<sensor_msgs::CameraInfo>("rendered/camera_info", 1)) {}

bool ViewPublisher::isDue() const {
  return images_.getNumSubscribers() > 0 && pace_.isDue(clock_());
}

void ViewPublisher::publish(const std_msgs::Header& header, const RenderCamera& camera,
                            const RenderedView& view, SteadyTime begin) {
  const sensor_msgs::ImagePtr image = imageOf(header, view);
  infos_.publish(makeCameraInfo(*image, camera.intrinsics));
  images_.publish(image);
  const SteadyTime end = clock_();
  pace_.begin(begin);
  pace_.restUntil(end + kFramesPerView * (end - begin));
}

}  // namespace dtsdf
