#include "ros/input/rectification.h"

#include <ros/console.h>

#include <sensor_msgs/distortion_models.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <utility>

#include "io/byte_order.h"
#include "params/printable.h"
#include "ros/input/images.h"

namespace dtsdf {
namespace {

using Matrix = cv::Matx33d;

/// Another camera_info in each message is another warning.
constexpr double kWarningPeriod_s = 5.0;

/// Not in the message headers of every distribution.
const std::string kEquidistant = "equidistant";

bool isDistorted(const sensor_msgs::CameraInfo& info) {
  return std::any_of(info.D.begin(), info.D.end(), [](double d) { return d != 0.0; });
}

bool isKnownModel(const sensor_msgs::CameraInfo& info) {
  const std::string& model = info.distortion_model;
  const size_t coefficients = info.D.size();
  if (model == sensor_msgs::distortion_models::PLUMB_BOB) {
    return coefficients == 4 || coefficients == 5;
  }
  if (model == sensor_msgs::distortion_models::RATIONAL_POLYNOMIAL) return coefficients == 8;
  return model == kEquidistant && coefficients == 4;
}

/// "/camera/depth/image_rect_raw" says that its images are rectified.
bool isNamedRectified(const std::string& topic) {
  const std::string uncompressed = topic.substr(0, topic.find("/compressedDepth"));
  return uncompressed.find("rect", uncompressed.rfind('/') + 1) != std::string::npos;
}

Matrix matrixOf(const Intrinsics& K) { return {K.fx, 0, K.cx, 0, K.fy, K.cy, 0, 0, 1}; }

/// Intrinsics of the raw image, with binning and region of interest.
Matrix rawCamera(const sensor_msgs::CameraInfo& info) {
  sensor_msgs::CameraInfo raw = info;
  raw.P.fill(0.0);
  return matrixOf(intrinsicsOf(raw));
}

Matrix rotationOf(const sensor_msgs::CameraInfo& info) {
  Matrix R(info.R.data());
  return std::abs(cv::determinant(R)) > 0.5 ? R : Matrix::eye();  // all 0: none is given
}

/// Where in the raw image each pixel of the rectified one comes from.
std::pair<cv::Mat, cv::Mat> sourcesOf(const sensor_msgs::CameraInfo& info, cv::Size size) {
  const Matrix K = rawCamera(info), R = rotationOf(info), P = matrixOf(intrinsicsOf(info));
  std::pair<cv::Mat, cv::Mat> uv;
  if (info.distortion_model == kEquidistant) {
    cv::fisheye::initUndistortRectifyMap(K, info.D, R, P, size, CV_32FC1, uv.first, uv.second);
  } else {
    cv::initUndistortRectifyMap(K, info.D, R, P, size, CV_32FC1, uv.first, uv.second);
  }
  return uv;
}

/// By how much depth along the rectified axis differs from that along the raw one, for each pixel;
/// 0, no measurement, for rays that the raw camera has behind it. Empty where the axes are equal.
std::vector<float> scalesOf(const sensor_msgs::CameraInfo& info, cv::Size size) {
  const Matrix R = rotationOf(info);
  if (R == Matrix::eye()) return {};
  const Matrix ray_of_pixel = R.t() * matrixOf(intrinsicsOf(info)).inv();
  std::vector<float> scales;
  scales.reserve(static_cast<size_t>(size.area()));
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const double along_axis = (ray_of_pixel * cv::Vec3d(u, v, 1.0))[2];
      scales.push_back(along_axis > 0.0 ? static_cast<float>(1.0 / along_axis) : 0.0f);
    }
  }
  return scales;
}

bool sameCamera(const sensor_msgs::CameraInfo& a, const sensor_msgs::CameraInfo& b) {
  return a.width == b.width && a.height == b.height && a.distortion_model == b.distortion_model &&
         a.D == b.D && a.K == b.K && a.R == b.R && a.P == b.P && a.binning_x == b.binning_x &&
         a.binning_y == b.binning_y && a.roi.x_offset == b.roi.x_offset &&
         a.roi.y_offset == b.roi.y_offset && a.roi.width == b.roi.width &&
         a.roi.height == b.roi.height;
}

uint16_t scaled(uint16_t raw, float scale) {
  if (raw == kNoDepth16) return raw;  // and stays that
  return static_cast<uint16_t>(
      std::lround(std::min(static_cast<float>(raw) * scale, static_cast<float>(kNoDepth16))));
}

float scaled(float raw, float scale) { return raw * scale; }

/// Fills the rectified pixels; 0, no measurement, where no raw one belongs.
template <class Pixel>
void fill(const DepthFrame& raw, const std::vector<int32_t>& source,
          const std::vector<float>& scale, std::vector<uint8_t>& bytes) {
  const auto* rows = static_cast<const uint8_t*>(raw.data);
  const auto width = static_cast<size_t>(raw.width);
  for (size_t i = 0; i < source.size(); ++i) {
    if (source[i] < 0) continue;
    const auto from = static_cast<size_t>(source[i]);
    Pixel pixel;
    std::memcpy(&pixel, rows + from / width * raw.row_bytes + from % width * sizeof(Pixel),
                sizeof(Pixel));
    if (!scale.empty()) pixel = scaled(pixel, scale[i]);
    std::memcpy(&bytes[i * sizeof(Pixel)], &pixel, sizeof(Pixel));
  }
}

/// All 0, of the size of another one.
sensor_msgs::ImagePtr emptyImage(const sensor_msgs::Image& like, const std::string& encoding,
                                 size_t pixel_bytes) {
  auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = like.header;
  image->encoding = encoding;
  image->width = like.width;
  image->height = like.height;
  image->is_bigendian = !hostIsLittleEndian();
  image->step = static_cast<uint32_t>(image->width * pixel_bytes);
  image->data.assign(static_cast<size_t>(image->step) * image->height, 0);
  return image;
}

/// The camera of the rectified image.
sensor_msgs::CameraInfoPtr rectifiedInfo(const sensor_msgs::CameraInfo& info, cv::Size size) {
  const Intrinsics K = intrinsicsOf(info);
  auto rectified = boost::make_shared<sensor_msgs::CameraInfo>();
  rectified->width = static_cast<uint32_t>(size.width);
  rectified->height = static_cast<uint32_t>(size.height);
  rectified->K = {K.fx, 0, K.cx, 0, K.fy, K.cy, 0, 0, 1};
  rectified->P = {K.fx, 0, K.cx, 0, 0, K.fy, K.cy, 0, 0, 0, 1, 0};
  return rectified;
}

}  // namespace

Rectification::Rectification(RectifyChoice choice, std::string topic, Kind kind)
    : choice_(choice), topic_(std::move(topic)), kind_(kind) {}

bool Rectification::isToBeUndone(const sensor_msgs::CameraInfo& info) const {
  if (!isDistorted(info)) return false;
  return choice_ == RectifyChoice::kAlways || !isNamedRectified(topic_);
}

std::string Rectification::obstacle(const sensor_msgs::CameraInfo& info) const {
  if (choice_ == RectifyChoice::kNever) return "input/rectify is never";
  if (isKnownModel(info)) return "";
  return "distortion model '" + printable(info.distortion_model) + "' with " +
         std::to_string(info.D.size()) + " coefficients is not supported";
}

CameraImage Rectification::applyAndWarn(const CameraImage& raw) {
  CameraImage camera = apply(raw);
  const ros::WallTime now = ros::WallTime::now();
  if (!warned_at_.isZero() && (now - warned_at_).toSec() < kWarningPeriod_s) return camera;
  const std::string warning = takeWarning();
  if (warning.empty()) return camera;
  warned_at_ = now;
  ROS_WARN_STREAM_NAMED("dtsdf_mapping", warning);
  return camera;
}

std::string Rectification::takeWarning() {
  if (warning_ == told_) return "";
  told_ = warning_;
  return warning_;
}

void Rectification::makeTable(const CameraImage& raw) {
  const cv::Size size(static_cast<int>(raw.image->width), static_cast<int>(raw.image->height));
  const auto [from_u, from_v] = sourcesOf(*raw.info, size);
  source_.clear();
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const float raw_u = from_u.at<float>(v, u), raw_v = from_v.at<float>(v, u);
      const bool inside = raw_u > -0.5f && raw_u < static_cast<float>(size.width) - 0.5f &&
                          raw_v > -0.5f && raw_v < static_cast<float>(size.height) - 0.5f;
      source_.push_back(
          inside ? static_cast<int32_t>(std::lround(raw_v) * size.width + std::lround(raw_u)) : -1);
    }
  }
  scale_ = scalesOf(*raw.info, size);
  rectified_info_ = rectifiedInfo(*raw.info, size);
  table_info_ = *raw.info;
}

CameraImage Rectification::apply(const CameraImage& raw) {
  if (!isToBeUndone(*raw.info)) return raw;
  const std::string problem = obstacle(*raw.info);
  if (!problem.empty()) {
    warning_ = "the images of '" + topic_ +
               "' are distorted and not rectified, so the map will be "
               "bent: " +
               problem;
    return raw;
  }
  if (!rectified_info_ || !sameCamera(table_info_, *raw.info)) makeTable(raw);
  const sensor_msgs::ImageConstPtr image =
      kind_ == Kind::kDepth ? rectifiedDepth(raw) : rectifiedColour(raw);
  return {image, rectified_info_};
}

sensor_msgs::ImageConstPtr Rectification::rectifiedDepth(const CameraImage& raw) const {
  cv_bridge::CvImageConstPtr pixels;
  const DepthFrame frame = makeDepthFrame(raw.image, *raw.info, {}, pixels);
  const bool is_16_bit = frame.encoding == DepthEncoding::kUint16;
  const auto image = emptyImage(*raw.image, raw.image->encoding, is_16_bit ? 2 : 4);
  is_16_bit ? fill<uint16_t>(frame, source_, scale_, image->data)
            : fill<float>(frame, source_, scale_, image->data);
  return image;
}

sensor_msgs::ImageConstPtr Rectification::rectifiedColour(const CameraImage& raw) const {
  cv_bridge::CvImageConstPtr pixels;
  const ColourFrame frame = makeColourFrame(raw.image, *raw.info, pixels);
  const size_t pixel_bytes = pixels->image.elemSize();
  const auto image = emptyImage(*raw.image, pixels->encoding, pixel_bytes);
  const auto* rows = static_cast<const uint8_t*>(frame.data);
  const auto width = static_cast<size_t>(frame.width);
  for (size_t i = 0; i < source_.size(); ++i) {
    if (source_[i] < 0) continue;
    const auto from = static_cast<size_t>(source_[i]);
    std::memcpy(&image->data[i * pixel_bytes],
                rows + from / width * frame.row_bytes + from % width * pixel_bytes, pixel_bytes);
  }
  return image;
}

}  // namespace dtsdf
