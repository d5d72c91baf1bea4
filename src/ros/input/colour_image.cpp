#include "ros/input/colour_image.h"

#include <sensor_msgs/image_encodings.h>
#include <boost/make_shared.hpp>
#include <opencv2/imgproc.hpp>

#include "params/printable.h"

namespace dtsdf {
namespace {

namespace enc = sensor_msgs::image_encodings;

/// Newer than the messages of some distributions.
const std::string kYuy2 = "yuv422_yuy2";

/// What the mapper takes as it is.
std::optional<ColourEncoding> knownEncoding(const std::string& encoding) {
  if (encoding == enc::RGB8) return ColourEncoding::kRgb8;
  if (encoding == enc::BGR8) return ColourEncoding::kBgr8;
  if (encoding == enc::RGBA8) return ColourEncoding::kRgba8;
  if (encoding == enc::BGRA8) return ColourEncoding::kBgra8;
  if (encoding == enc::MONO8) return ColourEncoding::kMono8;
  return std::nullopt;
}

bool isYuv(const std::string& encoding) { return encoding == enc::YUV422 || encoding == kYuy2; }

size_t pixelBytes(const std::string& encoding) {
  if (isYuv(encoding)) return 2;
  return static_cast<size_t>(enc::numChannels(encoding) * enc::bitDepth(encoding) / 8);
}

cv_bridge::CvImageConstPtr yuy2AsRgb(const sensor_msgs::Image& image) {
  const cv::Mat yuv(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC2,
                    const_cast<uint8_t*>(image.data.data()), image.step);
  const auto rgb = boost::make_shared<cv_bridge::CvImage>(image.header, enc::RGB8);
  cv::cvtColor(yuv, rgb->image, cv::COLOR_YUV2RGB_YUY2);
  return rgb;
}

/// What the mapper does not take, as what it does.
cv_bridge::CvImageConstPtr converted(const sensor_msgs::ImageConstPtr& image) {
  if (image->encoding == kYuy2) return yuy2AsRgb(*image);
  return cv_bridge::toCvCopy(image, image->encoding == enc::MONO16 ? enc::MONO8 : enc::RGB8);
}

}  // namespace

bool showsColour(const std::string& encoding) {
  const bool is_grey = encoding == enc::MONO8 || encoding == enc::MONO16;
  return isColourEncoding(encoding) && !is_grey;
}

bool isColourEncoding(const std::string& encoding) {
  return knownEncoding(encoding) || encoding == enc::MONO16 || enc::isBayer(encoding) ||
         isYuv(encoding);
}

std::optional<Rejection> checkColourImage(const sensor_msgs::Image& image,
                                          const sensor_msgs::CameraInfo& info) {
  if (image.header.stamp.isZero()) {
    return Rejection{DropReason::kNoStamp, "the image has no stamp, so its pose is unknown"};
  }
  if (!isColourEncoding(image.encoding)) {
    return Rejection{DropReason::kBadEncoding,
                     "encoding '" + printable(image.encoding) +
                         "'; colour must be rgb8, bgr8, rgba8, bgra8, mono8, mono16, Bayer or YUV "
                         "4:2:2"};
  }
  if (isYuv(image.encoding) && image.width % 2 != 0) {
    return Rejection{DropReason::kBadImage,
                     "YUV 4:2:2 needs rows of an even number of pixels, "
                     "not " +
                         std::to_string(image.width)};
  }
  return checkImage(image, info, pixelBytes(image.encoding));
}

ColourFrame makeColourFrame(const sensor_msgs::ImageConstPtr& image,
                            const sensor_msgs::CameraInfo& info,
                            cv_bridge::CvImageConstPtr& pixels) {
  const sensor_msgs::ImageConstPtr tidy = tidied(image, pixelBytes(image->encoding));
  pixels = knownEncoding(image->encoding) ? cv_bridge::toCvShare(tidy) : converted(tidy);
  ColourFrame frame;
  frame.width = pixels->image.cols;
  frame.height = pixels->image.rows;
  frame.encoding = *knownEncoding(pixels->encoding);
  frame.intrinsics = intrinsicsOf(info);
  frame.data = pixels->image.data;
  frame.row_bytes = pixels->image.step[0];
  return frame;
}

}  // namespace dtsdf
