#include "ros/input/images.h"

#include <sensor_msgs/image_encodings.h>
#include <boost/make_shared.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "params/intrinsics_check.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/input/conversions.h"

namespace dtsdf {
namespace {

/// More than the number of coefficients of any of OpenCV's distortion models.
constexpr size_t kMaxCoefficients = 64;
/// Latest stamp of an image: an hour before ROS time ends, so that durations can be added to it.
constexpr double kLatestStamp_s = kEndOfTime_s - 3600.0;

/// The region of interest; the whole image unless it is set.
sensor_msgs::RegionOfInterest regionOf(const sensor_msgs::CameraInfo& info) {
  if (info.roi.width != 0 && info.roi.height != 0) return info.roi;
  sensor_msgs::RegionOfInterest whole;
  whole.width = info.width;
  whole.height = info.height;
  return whole;
}

/// A binning of 0 means none.
uint32_t pixelsBinned(uint32_t binning) { return std::max<uint32_t>(binning, 1); }

std::optional<Rejection> checkSize(const sensor_msgs::Image& image,
                                   const sensor_msgs::CameraInfo& info) {
  const sensor_msgs::RegionOfInterest region = regionOf(info);
  const uint32_t width = region.width / pixelsBinned(info.binning_x);
  const uint32_t height = region.height / pixelsBinned(info.binning_y);
  if (image.width == width && image.height == height) return std::nullopt;
  return Rejection{drop::kSizeMismatch,
                   formatted("the image is %u x %u, but its camera_info is for %u x %u",
                             image.width, image.height, width, height)};
}

std::optional<Rejection> checkIntrinsics(const sensor_msgs::Image& image,
                                         const sensor_msgs::CameraInfo& info) {
  std::string text = findProblem(intrinsicsOf(info), static_cast<int>(image.width),
                                 static_cast<int>(image.height));
  if (!std::all_of(info.D.begin(), info.D.end(), [](double d) { return std::isfinite(d); })) {
    text = "distortion coefficients (D) are not finite";
  }
  if (text.empty()) return std::nullopt;
  return Rejection{drop::kBadIntrinsics, "camera_info: " + text};
}

std::optional<Rejection> checkPixels(const sensor_msgs::Image& image, size_t pixel_bytes) {
  const size_t row = image.width * pixel_bytes;
  const size_t needed =
      image.height == 0 ? 0 : static_cast<size_t>(image.step) * (image.height - 1) + row;
  if (image.width > 0 && image.height > 0 && image.step >= row && image.data.size() >= needed) {
    return std::nullopt;
  }
  return Rejection{
      drop::kBadImage,
      formatted("rows of %u bytes, %zu bytes in total, do not fit an image of %u x %u pixels in ",
                image.step, image.data.size(), image.width, image.height) +
          printable(image.encoding)};
}

}  // namespace

Intrinsics intrinsicsOf(const sensor_msgs::CameraInfo& info) {
  const bool has_projection = info.P[0] != 0.0;
  const double fx = has_projection ? info.P[0] : info.K[0];
  const double fy = has_projection ? info.P[5] : info.K[4];
  const double cx = has_projection ? info.P[2] : info.K[2];
  const double cy = has_projection ? info.P[6] : info.K[5];
  const sensor_msgs::RegionOfInterest region = regionOf(info);
  const uint32_t x = pixelsBinned(info.binning_x), y = pixelsBinned(info.binning_y);
  return {static_cast<float>(fx / x), static_cast<float>(fy / y),
          static_cast<float>((cx - region.x_offset) / x),
          static_cast<float>((cy - region.y_offset) / y)};
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

std::optional<Rejection> checkArrival(const sensor_msgs::Image& image, size_t max_bytes) {
  if (image.height != 0 && image.width > maxImagePixels() / image.height) {
    return Rejection{drop::kTooLarge,
                     formatted("the image has %u x %u pixels; at most %zu are supported",
                               image.width, image.height, maxImagePixels())};
  }
  if (image.data.size() > max_bytes) {
    return Rejection{
        drop::kTooLarge,
        formatted("the image has %zu bytes; the queue holds at most %zu (input/queue_mb)",
                  image.data.size(), max_bytes)};
  }
  if (image.header.frame_id.size() > kLongestName || image.encoding.size() > kLongestName) {
    return Rejection{
        drop::kLongName,
        formatted("its frame_id or its encoding has more than %zu bytes", kLongestName)};
  }
  if (image.header.stamp.toSec() >= kLatestStamp_s) {
    return Rejection{drop::kBadStamp, "its stamp is at the end of the range of ROS time"};
  }
  return std::nullopt;
}

std::string findProblem(const sensor_msgs::CameraInfo& info) {
  if (info.header.frame_id.size() > kLongestName || info.distortion_model.size() > kLongestName) {
    return formatted("its frame_id or its distortion_model has more than %zu bytes", kLongestName);
  }
  if (info.D.size() <= kMaxCoefficients) return "";
  return formatted("it has %zu distortion coefficients, more than any known model", info.D.size());
}

std::optional<Rejection> checkImage(const sensor_msgs::Image& image,
                                    const sensor_msgs::CameraInfo& info, size_t pixel_bytes) {
  if (image.header.stamp.isZero()) {
    return Rejection{drop::kNoStamp,
                     "the image has no stamp, so its pose is unknown; drivers send stamp 0 while "
                     "/use_sim_time is true and nothing publishes /clock"};
  }
  if (auto rejection = checkPixels(image, pixel_bytes)) return rejection;
  if (auto rejection = checkSize(image, info)) return rejection;
  return checkIntrinsics(image, info);
}

namespace {

namespace enc = sensor_msgs::image_encodings;

/// Some drivers call 16-bit depth "mono16".
std::optional<DepthEncoding> depthEncodingOf(const std::string& encoding) {
  if (encoding == enc::TYPE_32FC1) return DepthEncoding::kFloat32;
  const bool is_16_bit = encoding == enc::TYPE_16UC1 || encoding == enc::MONO16;
  return is_16_bit ? std::optional<DepthEncoding>(DepthEncoding::kUint16) : std::nullopt;
}

std::optional<Rejection> checkMask(const sensor_msgs::Image& mask,
                                   const sensor_msgs::Image& depth) {
  if (mask.encoding != enc::MONO8 && mask.encoding != enc::TYPE_8UC1) {
    return Rejection{drop::kBadEncoding, "the mask has the encoding '" + printable(mask.encoding) +
                                             "'; it must be mono8"};
  }
  if (mask.width != depth.width || mask.height != depth.height) {
    return Rejection{drop::kSizeMismatch,
                     formatted("the mask is %u x %u, but its image is %u x %u", mask.width,
                               mask.height, depth.width, depth.height)};
  }
  return checkPixels(mask, 1);
}

}  // namespace

std::string withoutTransport(const std::string& topic) {
  for (const std::string ending : {kCompressedDepthTopic, kCompressedTopic}) {
    if (hasEnding(topic, ending)) return topic.substr(0, topic.size() - ending.size());
  }
  return topic;
}

bool isDepthEncoding(const std::string& encoding) { return depthEncodingOf(encoding).has_value(); }

std::optional<Rejection> checkDepthImage(const CameraImage& given) {
  const sensor_msgs::Image& image = *given.image;
  if (!isDepthEncoding(image.encoding)) {
    return Rejection{drop::kBadEncoding, "the encoding is '" + printable(image.encoding) +
                                             "'; depth must be 16UC1 or 32FC1"};
  }
  if (auto rejection = checkImage(image, *given.info, image.encoding == enc::TYPE_32FC1 ? 4 : 2)) {
    return rejection;
  }
  return given.mask ? checkMask(*given.mask, image) : std::nullopt;
}

DepthFrame makeDepthFrame(const sensor_msgs::ImageConstPtr& image,
                          const sensor_msgs::CameraInfo& info, cv_bridge::CvImageConstPtr& pixels,
                          float unit_16uc1_m, float unit_32fc1_m) {
  pixels = cv_bridge::toCvShare(image);
  DepthFrame frame;
  // Takes size and type from the message, since after swapping bytes, cv_bridge returns a matrix of
  // single bytes.
  frame.width = static_cast<int>(image->width);
  frame.height = static_cast<int>(image->height);
  frame.encoding = *depthEncodingOf(image->encoding);
  frame.unit_m = frame.encoding == DepthEncoding::kUint16 ? unit_16uc1_m : unit_32fc1_m;
  frame.intrinsics = intrinsicsOf(info);
  frame.data = pixels->image.data;
  frame.row_bytes = pixels->image.step[0];
  return frame;
}

namespace {

/// Missing from the message headers of some ROS distributions.
const std::string kYuy2 = "yuv422_yuy2";

/// The mapper's value for an encoding that it accepts unchanged.
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

/// Converts an image to an encoding that the mapper accepts.
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

std::optional<Rejection> checkColourImage(const CameraImage& given) {
  const sensor_msgs::Image& image = *given.image;
  if (!isColourEncoding(image.encoding)) {
    return Rejection{drop::kBadEncoding,
                     "the encoding is '" + printable(image.encoding) +
                         "'; colour must be rgb8, bgr8, rgba8, bgra8, mono8, mono16, Bayer or YUV "
                         "4:2:2"};
  }
  if (isYuv(image.encoding) && image.width % 2 != 0) {
    return Rejection{drop::kBadImage, "the width of a YUV 4:2:2 image must be even, not " +
                                          std::to_string(image.width)};
  }
  return checkImage(image, *given.info, pixelBytes(image.encoding));
}

ColourFrame makeColourFrame(const sensor_msgs::ImageConstPtr& image,
                            const sensor_msgs::CameraInfo& info,
                            cv_bridge::CvImageConstPtr& pixels) {
  pixels = knownEncoding(image->encoding) ? cv_bridge::toCvShare(image) : converted(image);
  ColourFrame frame;
  frame.width = pixels->image.cols;
  frame.height = pixels->image.rows;
  frame.encoding = *knownEncoding(pixels->encoding);
  frame.intrinsics = intrinsicsOf(info);
  frame.data = pixels->image.data;
  frame.row_bytes = pixels->image.step[0];
  return frame;
}

sensor_msgs::ImageConstPtr applyMask(const sensor_msgs::Image& mask,
                                     const sensor_msgs::Image& depth) {
  const cv::Size size(static_cast<int>(depth.width), static_cast<int>(depth.height));
  const auto masked = boost::make_shared<sensor_msgs::Image>(depth);
  const int type = depth.encoding == enc::TYPE_32FC1 ? CV_32FC1 : CV_16UC1;
  const cv::Mat hidden(size, CV_8UC1, const_cast<uint8_t*>(mask.data.data()), mask.step);
  // In both encodings, 0 means no measurement, and its bytes are the same in either byte order.
  cv::Mat(size, type, masked->data.data(), masked->step).setTo(0, hidden);
  return masked;
}

bool holdsDepth(const sensor_msgs::CompressedImage& message) {
  return isDepthEncoding(encodingOfCompressedDepth(message.format));
}

namespace {

sensor_msgs::ImageConstPtr makeImage(const std_msgs::Header& header, const std::string& encoding,
                                     Raster<uint8_t> decoded) {
  const cv::Mat pixels(decoded.height, decoded.width, cv_bridge::getCvType(encoding),
                       decoded.values.data());
  return cv_bridge::CvImage(header, encoding, pixels).toImageMsg();
}

}  // namespace

sensor_msgs::ImageConstPtr decodeDepth(const sensor_msgs::CompressedImage& message) {
  return makeImage(message.header, encodingOfCompressedDepth(message.format),
                   decodeCompressedDepth(message.format, message.data));
}

bool holdsColour(const sensor_msgs::CompressedImage& message) {
  const std::string& format = message.format;
  if (holdsDepth(message) || isDepthEncoding(format.substr(0, format.find(';')))) return false;
  const bool names_code = format.find("jpeg") != std::string::npos ||
                          format.find("jpg") != std::string::npos ||
                          format.find("png") != std::string::npos;
  return names_code && format.rfind(enc::MONO8, 0) != 0;
}

sensor_msgs::ImageConstPtr decodeColour(const sensor_msgs::CompressedImage& message) {
  return makeImage(message.header, enc::RGB8,
                   decodeColour(message.data.data(), message.data.size(), "the compressed image"));
}

}  // namespace dtsdf
