/// Converts organised clouds to depth images, for drivers that publish nothing else.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <string>
#include <utility>
#include <variant>

#include "ros/input/images.h"

namespace dtsdf {

/// The value of the parameter image_transport that selects clouds.
constexpr char kCloudTransport[] = "cloud";

/// Converts the clouds of one topic to 32FC1 depth images. Fits a pinhole camera to the first cloud
/// with enough points, and again if the size of the clouds changes. Not thread-safe.
class CloudImages {
 public:
  explicit CloudImages(std::string topic) : topic_(std::move(topic)) {}

  /// Returns the depth image or what is wrong with the cloud. The image comes with the fitted
  /// camera unless `has_info`, that is, unless there is a camera_info. `max_bytes` is the size of
  /// the queue, as in checkArrival().
  std::variant<CameraImage, Rejection> convert(const sensor_msgs::PointCloud2& cloud, bool has_info,
                                               size_t max_bytes);

  /// The fitted camera and its residual, as text; empty before a fit.
  const std::string& camera() const { return camera_; }

 private:
  const std::string topic_;
  uint32_t width_ = 0, height_ = 0;  ///< Size of the fitted cloud.
  Intrinsics intrinsics_{};
  std::string camera_;
};

}  // namespace dtsdf
