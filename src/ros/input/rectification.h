/// Undoes the distortion of raw images.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <variant>

#include "params/node_params.h"
#include "ros/input/images.h"

namespace dtsdf {

/// Rectifies the images on one topic with K, D, R and P from their camera_info. Supports the models
/// plumb_bob, rational_polynomial and equidistant. Samples the nearest raw pixel, since the mean of
/// two depths may lie on neither surface. Not thread-safe.
class Rectification {
 public:
  /// Unless `choice` is kAlways, images count as rectified if the name of `topic` says so.
  /// `is_colour` is needed because mono16 may be depth or colour.
  Rectification(Usage choice, std::string topic, bool is_colour = false)
      : choice_(choice), topic_(std::move(topic)), is_colour_(is_colour) {}

  /// The rectified image; `raw` itself if it needs no rectification, or if warning() says why it
  /// cannot be rectified.
  /// @pre `raw` has passed checkDepthImage() or checkColourImage().
  CameraImage apply(const CameraImage& raw);

  /// The masked and rectified frame of an image that has passed its checks, without its pose. Unit
  /// and axis of depth are as in `input`, but clouds are in metres along the optical axis, and not
  /// distorted. `pixels` owns the data, as in makeDepthFrame() and makeColourFrame().
  /// @throws std::exception from OpenCV or cv_bridge, or if there is too little memory.
  std::variant<DepthFrame, ColourFrame> frameOf(const CameraImage& raw, bool is_cloud,
                                                const InputParams& input,
                                                cv_bridge::CvImageConstPtr& pixels);

  /// Why the last image could not be rectified; empty if there is no such problem.
  const std::string& warning() const { return warning_; }

 private:
  /// Why a distorted image cannot be rectified; empty if it can.
  std::string obstacle(const sensor_msgs::CameraInfo& info) const;
  bool needsRectification(const sensor_msgs::CameraInfo& info) const;
  void makeTable(const CameraImage& raw);
  sensor_msgs::ImageConstPtr rectified(const CameraImage& raw) const;

  Usage choice_;
  std::string topic_;
  bool is_colour_;
  std::string warning_;

  sensor_msgs::CameraInfo table_info_;  ///< Used for computing source_. Its header is empty.
  sensor_msgs::CameraInfoConstPtr rectified_info_;  ///< Its stamp may be that of an earlier image.
  cv::Mat source_;  ///< Coordinates of each pixel in the raw image, for cv::remap().
};

}  // namespace dtsdf
