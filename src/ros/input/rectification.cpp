#include "ros/input/rectification.h"

#include <sensor_msgs/distortion_models.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "level/frame_points.h"
#include "params/printable.h"

namespace dtsdf {
namespace {

using Matrix = cv::Matx33d;

namespace models = sensor_msgs::distortion_models;

bool isDistorted(const sensor_msgs::CameraInfo& info) {
  return std::any_of(info.D.begin(), info.D.end(), [](double d) { return d != 0.0; });
}

/// Drivers use the names plumb_bob and rational_polynomial with any number of coefficients. OpenCV
/// chooses the model by that number.
bool isKnownModel(const sensor_msgs::CameraInfo& info) {
  const std::string& model = info.distortion_model;
  const size_t coefficients = info.D.size();
  if (model == models::EQUIDISTANT) return coefficients == 4;
  constexpr size_t kOfOpenCv[] = {4, 5, 8, 12, 14};
  return (model == models::PLUMB_BOB || model == models::RATIONAL_POLYNOMIAL) &&
         std::count(std::begin(kOfOpenCv), std::end(kOfOpenCv), coefficients) > 0;
}

/// Whether the name says that images are rectified, as in "/camera/depth/image_rect_raw".
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
  return std::abs(cv::determinant(R)) > 0.5 ? R : Matrix::eye();  // R is all 0 if none is given
}

bool isRotated(const sensor_msgs::CameraInfo& info) {
  constexpr double kSameAxes = 1e-6;
  return cv::norm(rotationOf(info), Matrix::eye(), cv::NORM_INF) > kSameAxes;
}

/// Whether the rectified image differs from the raw one in intrinsics or axes.
bool isMoved(const sensor_msgs::CameraInfo& info) {
  const Matrix K = rawCamera(info), P = matrixOf(intrinsicsOf(info));
  constexpr double kSamePixel = 0.01;
  return K(0, 0) > 0.0 && (cv::norm(K, P, cv::NORM_INF) > kSamePixel || isRotated(info));
}

/// For each pixel of the rectified image, its coordinates in the raw image.
std::pair<cv::Mat, cv::Mat> rectificationMaps(const sensor_msgs::CameraInfo& info, cv::Size size) {
  const Matrix K = rawCamera(info), R = rotationOf(info), P = matrixOf(intrinsicsOf(info));
  std::pair<cv::Mat, cv::Mat> uv;
  const std::vector<double> D = isDistorted(info) ? info.D : std::vector<double>();
  if (info.distortion_model == models::EQUIDISTANT && !D.empty()) {
    cv::fisheye::initUndistortRectifyMap(K, D, R, P, size, CV_32FC1, uv.first, uv.second);
  } else {
    cv::initUndistortRectifyMap(K, D, R, P, size, CV_32FC1, uv.first, uv.second);
  }
  return uv;
}

}  // namespace

bool Rectification::needsRectification(const sensor_msgs::CameraInfo& info) const {
  if (!isDistorted(info) && !isMoved(info)) return false;
  return choice_ == Usage::kAlways || !isNamedRectified(topic_);
}

std::string Rectification::obstacle(const sensor_msgs::CameraInfo& info) const {
  if (choice_ == Usage::kNever) return "input/rectify is never";
  if (!is_colour_ && isRotated(info)) return "R of camera_info rotates depth";
  if (isDistorted(info) && !(rawCamera(info)(0, 0) > 0.0)) return "K of camera_info is 0";
  if (!isDistorted(info) || isKnownModel(info)) return "";
  return "distortion model '" + printable(info.distortion_model) + "' with " +
         std::to_string(info.D.size()) + " coefficients is not supported";
}

void Rectification::makeTable(const CameraImage& raw) {
  const cv::Size size(static_cast<int>(raw.image->width), static_cast<int>(raw.image->height));
  const auto [from_u, from_v] = rectificationMaps(*raw.info, size);
  cv::Mat unused;
  cv::convertMaps(from_u, from_v, source_, unused, CV_16SC2, true);
  rectified_info_ = boost::make_shared<sensor_msgs::CameraInfo>(
      makeCameraInfo(*raw.image, intrinsicsOf(*raw.info)));
}

CameraImage Rectification::apply(const CameraImage& raw) {
  warning_.clear();
  if (!needsRectification(*raw.info)) return raw;
  const std::string problem = obstacle(*raw.info);
  if (!problem.empty()) {
    warning_ = "the images on '" + topic_ +
               "' are distorted and not rectified, so the map will be warped: " + problem;
    return raw;
  }
  sensor_msgs::CameraInfo camera = *raw.info;
  camera.header = std_msgs::Header();
  if (!rectified_info_ || !(camera == table_info_)) makeTable(raw);
  table_info_ = camera;
  return {rectified(raw), rectified_info_};
}

std::variant<DepthFrame, ColourFrame> Rectification::frameOf(const CameraImage& raw, bool is_cloud,
                                                             const InputParams& input,
                                                             cv_bridge::CvImageConstPtr& pixels) {
  CameraImage camera = raw;
  if (raw.mask) camera.image = applyMask(*raw.mask, *raw.image);
  if (!is_cloud) camera = apply(camera);
  if (is_colour_) return makeColourFrame(camera.image, *camera.info, pixels);
  DepthFrame depth = makeDepthFrame(camera.image, *camera.info, pixels, input.unit_16uc1_m,
                                    is_cloud ? 1.0f : input.unit_32fc1_m);
  if (input.depth_along_ray && !is_cloud) {
    const auto turned = boost::make_shared<cv_bridge::CvImage>();
    turned->image.create(depth.height, depth.width, CV_32FC1);
    rayToAxialDepth(depth, turned->image.ptr<float>());
    pixels = turned;
  }
  return depth;
}

/// Copies the raw pixel on the ray of each rectified pixel; 0 (no measurement) outside the raw
/// image.
sensor_msgs::ImageConstPtr Rectification::rectified(const CameraImage& raw) const {
  cv_bridge::CvImageConstPtr pixels;
  cv::Mat source, image;
  if (is_colour_) {
    makeColourFrame(raw.image, *raw.info, pixels);
    source = pixels->image;
  } else {
    const DepthFrame frame = makeDepthFrame(raw.image, *raw.info, pixels);
    // Does not use cv_bridge's matrix, which has single bytes as elements if cv_bridge has swapped
    // bytes.
    source = cv::Mat(frame.height, frame.width,
                     frame.encoding == DepthEncoding::kUint16 ? CV_16UC1 : CV_32FC1,
                     const_cast<void*>(frame.data), frame.row_bytes);
  }
  cv::remap(source, image, source_, cv::noArray(), cv::INTER_NEAREST, cv::BORDER_CONSTANT);
  const std::string& encoding = is_colour_ ? pixels->encoding : raw.image->encoding;
  return cv_bridge::CvImage(raw.image->header, encoding, image).toImageMsg();
}

}  // namespace dtsdf
