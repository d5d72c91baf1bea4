#include "ros/input/depth_image.h"

#include <sensor_msgs/image_encodings.h>

#include <boost/make_shared.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

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

/// The region of interest counts only if it is set; all zeros mean the whole image.
struct Sampling {
  uint32_t width, height, x_offset, y_offset, binning_x, binning_y;
};

Sampling samplingOf(const sensor_msgs::CameraInfo& info) {
  const bool has_roi = info.roi.width != 0 && info.roi.height != 0;
  return {has_roi ? info.roi.width : info.width,
          has_roi ? info.roi.height : info.height,
          has_roi ? info.roi.x_offset : 0,
          has_roi ? info.roi.y_offset : 0,
          std::max<uint32_t>(info.binning_x, 1),
          std::max<uint32_t>(info.binning_y, 1)};
}

std::optional<Rejection> checkSize(const sensor_msgs::Image& image,
                                   const sensor_msgs::CameraInfo& info) {
  const Sampling sampling = samplingOf(info);
  const uint32_t width = sampling.width / sampling.binning_x;
  const uint32_t height = sampling.height / sampling.binning_y;
  if (image.width == width && image.height == height) return std::nullopt;
  std::ostringstream text;
  text << "the image is " << image.width << " x " << image.height << ", but its camera_info is for "
       << width << " x " << height;
  return Rejection{DropReason::kSizeMismatch, text.str()};
}

std::optional<Rejection> checkIntrinsics(const sensor_msgs::CameraInfo& info) {
  const Intrinsics K = intrinsicsOf(info);
  if (K.fx > 0.0f && K.fy > 0.0f && std::isfinite(K.fx) && std::isfinite(K.fy) &&
      std::isfinite(K.cx) && std::isfinite(K.cy)) {
    return std::nullopt;
  }
  std::ostringstream text;
  text << "camera_info has fx = " << K.fx << ", fy = " << K.fy << ", cx = " << K.cx
       << ", cy = " << K.cy << "; is the camera calibrated?";
  return Rejection{DropReason::kBadIntrinsics, text.str()};
}

std::optional<Rejection> checkPixels(const sensor_msgs::Image& image, const PixelFormat& format) {
  const size_t row = image.width * format.bytes;
  const size_t needed =
      image.height == 0 ? 0 : static_cast<size_t>(image.step) * (image.height - 1) + row;
  if (image.width > 0 && image.height > 0 && image.step >= row && image.data.size() >= needed) {
    return std::nullopt;
  }
  std::ostringstream text;
  text << "rows of " << image.step << " bytes and " << image.data.size() << " bytes in all do not "
       << "make an image of " << image.width << " x " << image.height << ", " << image.encoding;
  return Rejection{DropReason::kBadImage, text.str()};
}

/// cv_bridge throws where the data go on after the last row or end without its padding, and OpenCV
/// where rows do not begin on whole pixels.
bool isTidy(const sensor_msgs::Image& image, size_t pixel_bytes) {
  return image.step % pixel_bytes == 0 &&
         image.data.size() == static_cast<size_t>(image.step) * image.height;
}

/// The image without padding.
sensor_msgs::ImageConstPtr makeTidy(const sensor_msgs::Image& image, size_t pixel_bytes) {
  const auto tidy = boost::make_shared<sensor_msgs::Image>();
  tidy->header = image.header;
  tidy->encoding = image.encoding;
  tidy->is_bigendian = image.is_bigendian;
  tidy->width = image.width;
  tidy->height = image.height;
  tidy->step = static_cast<uint32_t>(image.width * pixel_bytes);
  tidy->data.resize(static_cast<size_t>(tidy->step) * image.height);
  for (size_t v = 0; v < image.height; ++v) {
    std::memcpy(&tidy->data[v * tidy->step], &image.data[v * image.step], tidy->step);
  }
  return tidy;
}

}  // namespace

bool isDepthEncoding(const std::string& encoding) { return pixelFormatOf(encoding).has_value(); }

Intrinsics intrinsicsOf(const sensor_msgs::CameraInfo& info) {
  const bool has_projection = info.P[0] != 0.0;
  const double fx = has_projection ? info.P[0] : info.K[0];
  const double fy = has_projection ? info.P[5] : info.K[4];
  const double cx = has_projection ? info.P[2] : info.K[2];
  const double cy = has_projection ? info.P[6] : info.K[5];
  const Sampling sampling = samplingOf(info);
  return {static_cast<float>(fx / sampling.binning_x), static_cast<float>(fy / sampling.binning_y),
          static_cast<float>((cx - sampling.x_offset) / sampling.binning_x),
          static_cast<float>((cy - sampling.y_offset) / sampling.binning_y)};
}

std::optional<Rejection> checkDepthImage(const sensor_msgs::Image& image,
                                         const sensor_msgs::CameraInfo& info) {
  if (image.header.stamp.isZero()) {
    return Rejection{DropReason::kNoStamp, "the image has no stamp, so its pose is unknown"};
  }
  const std::optional<PixelFormat> format = pixelFormatOf(image.encoding);
  if (!format) {
    return Rejection{DropReason::kBadEncoding,
                     "encoding '" + image.encoding + "'; depth has to be 16UC1 or 32FC1"};
  }
  if (auto rejection = checkPixels(image, *format)) return rejection;
  if (auto rejection = checkSize(image, info)) return rejection;
  return checkIntrinsics(info);
}

DepthFrame makeDepthFrame(const sensor_msgs::ImageConstPtr& image,
                          const sensor_msgs::CameraInfo& info, const DepthUnits& units,
                          cv_bridge::CvImageConstPtr& pixels) {
  const PixelFormat format = *pixelFormatOf(image->encoding);
  pixels = cv_bridge::toCvShare(isTidy(*image, format.bytes) ? image
                                                             : makeTidy(*image, format.bytes));
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
