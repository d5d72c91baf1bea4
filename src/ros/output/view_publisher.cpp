#include "ros/output/view_publisher.h"

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/distortion_models.h>
#include <sensor_msgs/image_encodings.h>

#include <boost/make_shared.hpp>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

namespace dtsdf {
namespace {

constexpr double kMostViews_hz = 5.0;
/// Of the map's time frames get at least so many times as much as views.
constexpr int kFramesPerView = 4;

/// As REP 118 has it: metres, and NaN where there is no surface.
sensor_msgs::ImagePtr imageOf(const std_msgs::Header& header, const RenderedView& view) {
  std::vector<float> depth_m = view.depth_m;
  for (float& depth : depth_m) {
    if (!(depth > 0.0f)) depth = std::numeric_limits<float>::quiet_NaN();
  }
  auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = header;
  image->width = static_cast<uint32_t>(view.width);
  image->height = static_cast<uint32_t>(view.height);
  image->encoding = sensor_msgs::image_encodings::TYPE_32FC1;
  const uint16_t probe = 1;
  uint8_t first_byte;
  std::memcpy(&first_byte, &probe, 1);
  image->is_bigendian = first_byte == 0 ? 1 : 0;
  image->step = image->width * static_cast<uint32_t>(sizeof(float));
  image->data.resize(depth_m.size() * sizeof(float));
  std::memcpy(image->data.data(), depth_m.data(), image->data.size());
  return image;
}

sensor_msgs::CameraInfoPtr infoOf(const std_msgs::Header& header, const RenderCamera& camera) {
  const Intrinsics& K = camera.intrinsics;
  auto info = boost::make_shared<sensor_msgs::CameraInfo>();
  info->header = header;
  info->width = static_cast<uint32_t>(camera.width);
  info->height = static_cast<uint32_t>(camera.height);
  info->distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info->D.assign(5, 0.0);
  info->K = {K.fx, 0.0, K.cx, 0.0, K.fy, K.cy, 0.0, 0.0, 1.0};
  info->R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info->P = {K.fx, 0.0, K.cx, 0.0, 0.0, K.fy, K.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
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
  infos_.publish(infoOf(header, camera));
  images_.publish(imageOf(header, view));
  const SteadyTime end = clock_();
  pace_.begin(begin);
  pace_.restUntil(end + kFramesPerView * (end - begin));
}

}  // namespace dtsdf
