/// Undoes the distortion of raw images.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "params/node_params.h"
#include "ros/input/images.h"

namespace dtsdf {

/// Rectifies the images of one topic by their camera_info: K, D, R and P, of the models plumb_bob,
/// rational_polynomial and equidistant. Each pixel takes the measurement nearest to where its ray
/// comes from, as means of two depths lie on neither surface; so does colour. Not for several
/// threads.
class Rectification {
 public:
  /// `topic` shows whether images are raw, where that is left open. 16 bits of grey may be depth or
  /// colour.
  Rectification(Usage choice, std::string topic, bool is_colour = false)
      : choice_(choice), topic_(std::move(topic)), is_colour_(is_colour) {}

  /// The image as it is, or rectified: one that has passed checkDepthImage() or checkColourImage().
  CameraImage apply(const CameraImage& raw);

  /// The frame of an image that has passed its checks, rectified, in the units and along the axis
  /// that the settings have; without its pose. Clouds are in metres along the axis, and have no
  /// distortion. Its data live in `pixels`, as those of makeDepthFrame() and makeColourFrame().
  /// @throws std::exception of OpenCV or cv_bridge, or for no memory.
  std::variant<DepthFrame, ColourFrame> frameOf(const CameraImage& raw, bool is_cloud,
                                                const InputParams& input,
                                                cv_bridge::CvImageConstPtr& pixels);

  /// Why the geometry of the last image is bent, which the log says; else empty.
  const std::string& warning() const { return warning_; }

 private:
  /// Why the image stays as it is although it is distorted; empty if it does not.
  std::string obstacle(const sensor_msgs::CameraInfo& info) const;
  bool isToBeUndone(const sensor_msgs::CameraInfo& info) const;
  void makeTable(const CameraImage& raw);
  sensor_msgs::ImageConstPtr rectified(const CameraImage& raw) const;

  Usage choice_;
  std::string topic_;
  bool is_colour_;
  std::string warning_, logged_;

  sensor_msgs::CameraInfo table_info_;              ///< What the table was made for.
  sensor_msgs::CameraInfoConstPtr rectified_info_;  ///< Without stamp.
  cv::Mat source_;             ///< For each pixel the raw one, as cv::remap() takes it.
  std::vector<float> scales_;  ///< From its depth to that along the new axis; empty: 1.
};

}  // namespace dtsdf
