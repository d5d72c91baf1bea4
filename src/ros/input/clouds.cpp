#include "ros/input/clouds.h"

#include <ros/console.h>
#include <sensor_msgs/image_encodings.h>
#include <boost/make_shared.hpp>

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

/// A coordinate of a point, wherever it lies in it.
double coordinateOf(const sensor_msgs::PointCloud2& cloud, const PointField& field,
                    const uint8_t* point) {
  constexpr bool kIsBigEndian = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;
  const size_t bytes = field.datatype == PointField::FLOAT64 ? sizeof(double) : sizeof(float);
  uint8_t value[sizeof(double)];
  std::copy_n(point + field.offset, bytes, value);
  if ((cloud.is_bigendian != 0) != kIsBigEndian) std::reverse(value, value + bytes);
  float single = 0.0f;
  double wide = 0.0;
  if (bytes == sizeof(wide)) return std::memcpy(&wide, value, sizeof(wide)), wide;
  return std::memcpy(&single, value, sizeof(single)), single;
}

std::optional<Rejection> findCoordinates(const sensor_msgs::PointCloud2& cloud, Coordinates& xyz) {
  for (size_t i = 0; i < xyz.size(); ++i) {
    const std::string name(1, "xyz"[i]);
    const auto field = std::find_if(cloud.fields.begin(), cloud.fields.end(),
                                    [&](const PointField& of) { return of.name == name; });
    const bool is_wide = field != cloud.fields.end() && field->datatype == PointField::FLOAT64;
    if (field == cloud.fields.end() || (!is_wide && field->datatype != PointField::FLOAT32) ||
        size_t{field->offset} + (is_wide ? 8 : 4) > cloud.point_step) {
      return Rejection{drop::kBadEncoding, "its points have no field '" + name +
                                               "' of type FLOAT32 or FLOAT64; the cloud must "
                                               "have x, y and z"};
    }
    xyz[i] = *field;
  }
  return std::nullopt;
}

std::optional<Rejection> checkRows(const sensor_msgs::PointCloud2& cloud) {
  if (cloud.height <= 1) {
    return Rejection{drop::kUnorganised,
                     formatted("the cloud has %u points in %u rows, so it is not known which pixel "
                               "a point is of; have the driver publish organised clouds, with a "
                               "row for each row of pixels, or depth images",
                               cloud.width, cloud.height)};
  }
  const size_t row = size_t{cloud.width} * cloud.point_step;
  if (row > 0 && cloud.row_step >= row &&
      cloud.data.size() >= size_t{cloud.row_step} * (cloud.height - 1) + row) {
    return std::nullopt;
  }
  return Rejection{drop::kBadImage,
                   formatted("rows of %u bytes and %zu bytes in all do not make a cloud of %u x %u",
                             cloud.row_step, cloud.data.size(), cloud.width, cloud.height)};
}

/// The line that fits pixels, by the slopes of their rays, best.
struct Line {
  double n = 0.0, a = 0.0, p = 0.0, aa = 0.0, ap = 0.0, pp = 0.0;  ///< Sums.

  void add(double slope, double pixel) {
    n += 1.0;
    a += slope;
    p += pixel;
    aa += slope * slope;
    ap += slope * pixel;
    pp += pixel * pixel;
  }
  double focal_px() const { return (ap - a * p / n) / (aa - a * a / n); }
  double center_px() const { return (p - focal_px() * a) / n; }
  double variance_px2() const { return (pp - p * p / n) / n; }
  /// What is left of the variance.
  double error_px2() const { return variance_px2() - focal_px() * (ap - a * p / n) / n; }
  /// Whether the pixels reach over enough of so many.
  bool isWide(uint32_t pixels) const {
    constexpr double kLeastPoints = 100.0, kLeastShare = 0.05;  // those of a whole image: 0.29
    return n >= kLeastPoints && std::sqrt(variance_px2()) >= kLeastShare * pixels;
  }
};

using Lines = std::array<Line, 2>;  ///< Along rows, and along columns.

/// Writes depth, and adds what is measured to the lines unless they are null.
void readPoints(const sensor_msgs::PointCloud2& cloud, const Coordinates& xyz, uint8_t* pixel,
                Lines* lines) {
  for (uint32_t v = 0; v < cloud.height; ++v) {
    const uint8_t* point = &cloud.data[size_t{v} * cloud.row_step];
    for (uint32_t u = 0; u < cloud.width; ++u, point += cloud.point_step, pixel += sizeof(float)) {
      const double z = coordinateOf(cloud, xyz[2], point);
      const bool is_measured = std::isfinite(z) && z > 0.0;
      const float depth = is_measured ? static_cast<float>(z) : kNone;
      std::memcpy(pixel, &depth, sizeof(depth));
      if (lines == nullptr || !is_measured) continue;
      const double x = coordinateOf(cloud, xyz[0], point) / z,
                   y = coordinateOf(cloud, xyz[1], point) / z;
      if (!std::isfinite(x) || !std::isfinite(y)) continue;
      (*lines)[0].add(x, u);
      (*lines)[1].add(y, v);
    }
  }
}

}  // namespace

std::variant<CameraImage, Rejection> CloudImages::convert(const sensor_msgs::PointCloud2& cloud,
                                                          bool has_info, size_t most_bytes) {
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
  if (const auto rejection = checkArrival(*image, most_bytes)) return *rejection;
  const bool is_known = width_ == cloud.width && height_ == cloud.height;
  Lines lines;
  const auto& [along_u, along_v] = lines;
  readPoints(cloud, xyz, image->data.data(), is_known ? nullptr : &lines);
  if (!is_known && along_u.isWide(cloud.width) && along_v.isWide(cloud.height)) {
    const double error_px = std::sqrt(std::max(0.0, along_u.error_px2() + along_v.error_px2()));
    constexpr double kMostError_px = 1.0;
    const Intrinsics fitted{
        static_cast<float>(along_u.focal_px()), static_cast<float>(along_v.focal_px()),
        static_cast<float>(along_u.center_px()), static_cast<float>(along_v.center_px())};
    if (!(error_px <= kMostError_px && fitted.fx > 0.0f && fitted.fy > 0.0f)) {
      return Rejection{drop::kBadIntrinsics,
                       formatted("no pinhole camera fits the cloud: its points are %.3g px off%s; "
                                 "it must be of a rectified depth image, in the optical frame (x "
                                 "right, y down)",
                                 error_px, error_px <= kMostError_px ? ", but mirrored" : "")};
    }
    width_ = cloud.width;
    height_ = cloud.height;
    intrinsics_ = fitted;
    camera_ = formatted("%u x %u, fx %.6g, fy %.6g, cx %.6g, cy %.6g, %.2g px off%s", width_,
                        height_, intrinsics_.fx, intrinsics_.fy, intrinsics_.cx, intrinsics_.cy,
                        error_px, has_info ? "; that of camera_info is used" : "");
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
