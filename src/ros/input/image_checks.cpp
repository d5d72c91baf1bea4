#include "ros/input/image_checks.h"

#include <boost/make_shared.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "io/compressed_depth.h"
#include "params/printable.h"

namespace dtsdf {
namespace {

/// The region of interest counts only if it is set; all zeros mean the whole image.
struct Sampling {
  uint32_t width, height, x_offset, y_offset, binning_x, binning_y;
};

Sampling samplingOf(const sensor_msgs::CameraInfo& info) {
  const bool has_roi = info.roi.width != 0 && info.roi.height != 0;
  return {has_roi ? info.roi.width : info.width, has_roi ? info.roi.height : info.height,
          has_roi ? info.roi.x_offset : 0,       has_roi ? info.roi.y_offset : 0,
          std::max<uint32_t>(info.binning_x, 1), std::max<uint32_t>(info.binning_y, 1)};
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

std::optional<Rejection> checkPixels(const sensor_msgs::Image& image, size_t pixel_bytes) {
  const size_t row = image.width * pixel_bytes;
  const size_t needed =
      image.height == 0 ? 0 : static_cast<size_t>(image.step) * (image.height - 1) + row;
  if (image.width > 0 && image.height > 0 && image.step >= row && image.data.size() >= needed) {
    return std::nullopt;
  }
  std::ostringstream text;
  text << "rows of " << image.step << " bytes and " << image.data.size() << " bytes in all do not "
       << "make an image of " << image.width << " x " << image.height << ", "
       << printable(image.encoding);
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

sensor_msgs::CameraInfo makeCameraInfo(const sensor_msgs::Image& image, const Intrinsics& K) {
  sensor_msgs::CameraInfo info;
  info.header = image.header;
  info.width = image.width;
  info.height = image.height;
  info.distortion_model = "plumb_bob";
  info.D.assign(5, 0.0);
  info.K = {K.fx, 0.0, K.cx, 0.0, K.fy, K.cy, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {K.fx, 0.0, K.cx, 0.0, 0.0, K.fy, K.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

std::optional<Rejection> checkArrival(const sensor_msgs::Image& image, size_t most_bytes) {
  if (image.height != 0 && image.width > mostImagePixels() / image.height) {
    std::ostringstream text;
    text << "the image has " << image.width << " x " << image.height << " pixels; at most "
         << mostImagePixels() << " are supported";
    return Rejection{DropReason::kTooLarge, text.str()};
  }
  if (image.data.size() <= most_bytes) return std::nullopt;
  std::ostringstream text;
  text << "the image has " << image.data.size() << " bytes; at most " << most_bytes
       << " may wait (input/queue_mb)";
  return Rejection{DropReason::kTooLarge, text.str()};
}

std::optional<Rejection> checkImage(const sensor_msgs::Image& image,
                                    const sensor_msgs::CameraInfo& info, size_t pixel_bytes) {
  if (auto rejection = checkPixels(image, pixel_bytes)) return rejection;
  if (auto rejection = checkSize(image, info)) return rejection;
  return checkIntrinsics(info);
}

sensor_msgs::ImageConstPtr tidied(const sensor_msgs::ImageConstPtr& image, size_t pixel_bytes) {
  return isTidy(*image, pixel_bytes) ? image : makeTidy(*image, pixel_bytes);
}

}  // namespace dtsdf
