#include "ros/input/clouds.h"

#include <ros/console.h>
#include <sensor_msgs/image_encodings.h>
#include <boost/make_shared.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "params/printable.h"
#include "params/text.h"

namespace dtsdf {
namespace {

using sensor_msgs::PointField;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

using Coordinates = std::array<PointField, 3>;

/// Reads a FLOAT32 or FLOAT64 coordinate of a point.
double coordinateOf(const PointField& field, const uint8_t* point) {
  const uint8_t* const value = point + field.offset;
  float single = 0.0f;
  double wide = 0.0;
  const bool is_wide = field.datatype == PointField::FLOAT64;
  if (is_wide) return std::memcpy(&wide, value, sizeof(wide)), wide;
  return std::memcpy(&single, value, sizeof(single)), single;
}

std::optional<Rejection> findCoordinates(const sensor_msgs::PointCloud2& cloud, Coordinates& xyz) {
  if (cloud.is_bigendian != 0) {
    return Rejection{drop::kBadEncoding, "big-endian clouds are not supported"};
  }
  for (size_t i = 0; i < xyz.size(); ++i) {
    const std::string name(1, "xyz"[i]);
    const auto field = std::find_if(cloud.fields.begin(), cloud.fields.end(),
                                    [&](const PointField& of) { return of.name == name; });
    const bool is_wide = field != cloud.fields.end() && field->datatype == PointField::FLOAT64;
    if (field == cloud.fields.end() || (!is_wide && field->datatype != PointField::FLOAT32) ||
        size_t{field->offset} + (is_wide ? 8 : 4) > cloud.point_step) {
      return Rejection{drop::kBadEncoding, "the cloud has no field '" + name +
                                               "' of type FLOAT32 or FLOAT64; it must have x, y "
                                               "and z"};
    }
    xyz[i] = *field;
  }
  return std::nullopt;
}

std::optional<Rejection> checkRows(const sensor_msgs::PointCloud2& cloud) {
  if (cloud.height <= 1) {
    return Rejection{
        drop::kUnorganised,
        formatted("the cloud is not organised (%u x %u), so its points match no pixels; make "
                  "the driver publish depth images, or organised clouds, with one point per pixel",
                  cloud.width, cloud.height)};
  }
  const size_t row = size_t{cloud.width} * cloud.point_step;
  if (row > 0 && cloud.row_step >= row &&
      cloud.data.size() >= size_t{cloud.row_step} * (cloud.height - 1) + row) {
    return std::nullopt;
  }
  return Rejection{drop::kBadImage,
                   formatted("rows of %u bytes, %zu bytes in total, do not fit a cloud of %u x %u",
                             cloud.row_step, cloud.data.size(), cloud.width, cloud.height)};
}

/// Sums of outer products of (1, slope of the ray, pixel coordinate), for u and for v.
using Sums = std::array<Eigen::Matrix3d, 2>;

/// Fits a line that maps the slopes of rays to pixel coordinates. @return focal length, centre,
/// variance of the coordinates, residual variance.
std::array<double, 4> fitLine(const Eigen::Matrix3d& sums) {
  const Eigen::Vector3d mean = sums.col(0) / sums(0, 0);
  const Eigen::Matrix3d covariance = sums / sums(0, 0) - mean * mean.transpose();
  const double focal_px = covariance(1, 2) / covariance(1, 1);
  return {focal_px, mean[2] - focal_px * mean[1], covariance(2, 2),
          covariance(2, 2) - focal_px * covariance(1, 2)};
}

/// Writes depths, and adds measured points to `sums` unless it is null.
void readPoints(const sensor_msgs::PointCloud2& cloud, const Coordinates& xyz, uint8_t* pixel,
                Sums* sums) {
  for (uint32_t v = 0; v < cloud.height; ++v) {
    const uint8_t* point = cloud.data.data() + size_t{v} * cloud.row_step;
    for (uint32_t u = 0; u < cloud.width; ++u, point += cloud.point_step, pixel += sizeof(float)) {
      const double z = coordinateOf(xyz[2], point);
      const bool is_measured = std::isfinite(z) && z > 0.0;
      const float depth = is_measured ? static_cast<float>(z) : kNone;
      std::memcpy(pixel, &depth, sizeof(depth));
      if (sums == nullptr || !is_measured) continue;
      const double x = coordinateOf(xyz[0], point) / z, y = coordinateOf(xyz[1], point) / z;
      if (!std::isfinite(x) || !std::isfinite(y)) continue;
      const Eigen::Vector3d along_u(1.0, x, u), along_v(1.0, y, v);
      (*sums)[0] += along_u * along_u.transpose();
      (*sums)[1] += along_v * along_v.transpose();
    }
  }
}

}  // namespace

std::variant<CameraImage, Rejection> CloudImages::convert(const sensor_msgs::PointCloud2& cloud,
                                                          bool has_info, size_t max_bytes) {
  Coordinates xyz{};
  if (const auto rejection = checkRows(cloud)) return *rejection;
  if (const auto rejection = findCoordinates(cloud, xyz)) return *rejection;
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = cloud.header;
  image->encoding = sensor_msgs::image_encodings::TYPE_32FC1;
  image->width = cloud.width;
  image->height = cloud.height;
  image->step = cloud.width * sizeof(float);
  image->data.resize(size_t{image->step} * cloud.height);
  if (const auto rejection = checkArrival(*image, max_bytes)) return *rejection;
  const bool is_known = width_ == cloud.width && height_ == cloud.height;
  Sums sums{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  readPoints(cloud, xyz, image->data.data(), is_known ? nullptr : &sums);
  const auto [fx, cx, variance_u, rest_u] = fitLine(sums[0]);
  const auto [fy, cy, variance_v, rest_v] = fitLine(sums[1]);
  // Whether the measured pixels are spread widely enough. If all are measured, the standard
  // deviation of u is 0.29 times the width.
  constexpr double kMinPoints = 100.0, kMinShare = 0.05;
  const bool is_wide = sums[0](0, 0) >= kMinPoints &&
                       std::sqrt(variance_u) >= kMinShare * cloud.width &&
                       std::sqrt(variance_v) >= kMinShare * cloud.height;
  if (!is_known && is_wide) {
    const double error_px = std::sqrt(std::max(0.0, rest_u + rest_v));
    constexpr double kMaxError_px = 1.0;
    const Intrinsics fitted{static_cast<float>(fx), static_cast<float>(fy), static_cast<float>(cx),
                            static_cast<float>(cy)};
    if (!(error_px <= kMaxError_px && fitted.fx > 0.0f && fitted.fy > 0.0f)) {
      return Rejection{
          drop::kBadIntrinsics,
          formatted("no pinhole camera fits the cloud: its points are %.3g px off%s; "
                    "clouds must come from a rectified depth image, in the optical frame "
                    "(x right, y down)",
                    error_px, error_px <= kMaxError_px ? ", but mirrored" : "")};
    }
    width_ = cloud.width;
    height_ = cloud.height;
    intrinsics_ = fitted;
    camera_ = formatted("%u x %u, fx %.6g, fy %.6g, cx %.6g, cy %.6g, %.2g px off%s", width_,
                        height_, intrinsics_.fx, intrinsics_.fy, intrinsics_.cx, intrinsics_.cy,
                        error_px, has_info ? "; camera_info is used instead" : "");
    ROS_INFO_STREAM_NAMED("dtsdf_mapping",
                          "camera fitted to a cloud on '" << printable(topic_) << "': " << camera_);
  } else if (!is_known && !has_info) {
    return Rejection{drop::kNoMeasurement,
                     "there is no camera_info, and too few points to fit a camera to the cloud"};
  }
  if (has_info) return CameraImage{image};
  return CameraImage{
      image, boost::make_shared<sensor_msgs::CameraInfo>(makeCameraInfo(*image, intrinsics_))};
}

}  // namespace dtsdf
