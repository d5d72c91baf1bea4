/// Organised clouds in place of depth images, for drivers that publish nothing else.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <string>
#include <utility>
#include <variant>

#include "ros/input/images.h"

namespace dtsdf {

/// The value of image_transport with which depth comes as clouds.
constexpr char kCloudTransport[] = "cloud";

/// Makes depth images of the clouds of one topic: the z of each point, as 32FC1. It finds the
/// pinhole camera of the first cloud by least squares, and reports it. Not for several threads.
class CloudImages {
 public:
  explicit CloudImages(std::string topic) : topic_(std::move(topic)) {}

  /// The depth image, with the camera that was found unless it `has_info` from elsewhere; or what
  /// is wrong with the cloud. `most_bytes`: see checkArrival().
  std::variant<CameraImage, Rejection> convert(const sensor_msgs::PointCloud2& cloud, bool has_info,
                                               size_t most_bytes);

  /// The camera that was found, and how well the cloud that it was found by fits it; empty before.
  const std::string& camera() const { return camera_; }

 private:
  const std::string topic_;
  uint32_t width_ = 0, height_ = 0;  ///< Size of the cloud that gave the camera.
  Intrinsics intrinsics_{};
  std::string camera_;
};

}  // namespace dtsdf
