#include "ros/input/depth_image.h"

#include <sensor_msgs/image_encodings.h>

#include "params/printable.h"

namespace dtsdf {
namespace {

namespace enc = sensor_msgs::image_encodings;

struct PixelFormat {
  DepthEncoding encoding;
  size_t bytes;
};

/// "mono16" is what some drivers call their 16-bit depth.
std::optional<PixelFormat> pixelFormatOf(const std::string& encoding) {
  if (encoding == enc::TYPE_16UC1 || encoding == enc::MONO16) {
    return PixelFormat{DepthEncoding::kUint16, sizeof(uint16_t)};
  }
  if (encoding == enc::TYPE_32FC1) return PixelFormat{DepthEncoding::kFloat32, sizeof(float)};
  return std::nullopt;
}

}  // namespace

bool isDepthEncoding(const std::string& encoding) { return pixelFormatOf(encoding).has_value(); }

std::optional<Rejection> checkDepthImage(const sensor_msgs::Image& image,
                                         const sensor_msgs::CameraInfo& info) {
  if (image.header.stamp.isZero()) {
    return Rejection{DropReason::kNoStamp, "the image has no stamp, so its pose is unknown"};
  }
  const std::optional<PixelFormat> format = pixelFormatOf(image.encoding);
  if (!format) {
    return Rejection{DropReason::kBadEncoding,
                     "encoding '" + printable(image.encoding) + "'; depth must be 16UC1 or 32FC1"};
  }
  return checkImage(image, info, format->bytes);
}

DepthFrame makeDepthFrame(const sensor_msgs::ImageConstPtr& image,
                          const sensor_msgs::CameraInfo& info, const DepthUnits& units,
                          cv_bridge::CvImageConstPtr& pixels) {
  const PixelFormat format = *pixelFormatOf(image->encoding);
  pixels = cv_bridge::toCvShare(tidied(image, format.bytes));
  DepthFrame frame;
  // Size and type by the message: cv_bridge leaves a matrix of bytes where it has swapped them.
  frame.width = static_cast<int>(image->width);
  frame.height = static_cast<int>(image->height);
  frame.encoding = format.encoding;
  frame.unit_m =
      format.encoding == DepthEncoding::kUint16 ? units.unit_16uc1_m : units.unit_32fc1_m;
  frame.intrinsics = intrinsicsOf(info);
  frame.data = pixels->image.data;
  frame.row_bytes = pixels->image.step[0];
  return frame;
}

}  // namespace dtsdf
