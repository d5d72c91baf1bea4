#include "tum_to_bag.h"

#include <geometry_msgs/TransformStamped.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "dtsdf_mapping/io/tum_frames.h"
#include "io/tum_sequence.h"
#include "ros/input/transform_conversions.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;
namespace enc = sensor_msgs::image_encodings;

std_msgs::Header makeHeader(double stamp_s, const std::string& frame) {
  std_msgs::Header header;
  header.stamp.fromSec(stamp_s);
  header.frame_id = frame;
  return header;
}

template <class Pixel, class Convert>
void fillPixels(const DepthFrame& depth, sensor_msgs::Image& image, Convert convert) {
  image.step = image.width * sizeof(Pixel);
  image.data.resize(static_cast<size_t>(image.step) * image.height);
  const auto* rows = static_cast<const uint8_t*>(depth.data);
  for (size_t v = 0; v < image.height; ++v) {
    for (size_t u = 0; u < image.width; ++u) {
      uint16_t raw = 0;
      std::memcpy(&raw, rows + v * depth.row_bytes + u * sizeof(raw), sizeof(raw));
      const Pixel pixel = convert(raw);
      std::memcpy(&image.data[v * image.step + u * sizeof(Pixel)], &pixel, sizeof(Pixel));
    }
  }
}

/// 32FC1 holds raw * unit as the mapper would compute it, so nothing is lost.
sensor_msgs::Image makeDepthImage(const SourceFrame& frame, const TumToBagOptions& options) {
  const DepthFrame& depth = frame.depth;
  sensor_msgs::Image image;
  image.header = makeHeader(frame.stamp_s, options.camera_frame);
  image.width = static_cast<uint32_t>(depth.width);
  image.height = static_cast<uint32_t>(depth.height);
  if (options.millimetres) {
    image.encoding = enc::TYPE_16UC1;
    fillPixels<uint16_t>(depth, image, [&](uint16_t raw) {
      const double depth_mm = 1000.0 * raw / options.units_per_metre;
      const bool fits = depth_mm < kNoDepth16 - 0.5;
      return fits ? static_cast<uint16_t>(std::lround(depth_mm)) : uint16_t{0};
    });
  } else {
    image.encoding = enc::TYPE_32FC1;
    fillPixels<float>(depth, image, [&](uint16_t raw) { return raw * depth.unit_m; });
  }
  return image;
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

tf2_msgs::TFMessage makeTransform(const SourceFrame& frame, const TumToBagOptions& options) {
  geometry_msgs::TransformStamped transform;
  transform.header = makeHeader(frame.stamp_s, options.map_frame);
  transform.child_frame_id = options.camera_frame;
  transform.transform = toTransform(frame.depth.T_W_C);
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform);
  return message;
}

/// Each frame with its transform, at the stamp at which the offline program would fuse it.
void writeDepth(const TumToBagOptions& options, rosbag::Bag& bag, TumToBagResult& result) {
  TumOptions tum;
  tum.folder = options.folder;
  tum.units_per_metre = options.units_per_metre;
  const std::unique_ptr<FrameSource> frames = openTumFrames(tum);
  const std::string topic = options.camera_namespace + "/depth";
  while (const std::optional<SourceFrame> frame = frames->next()) {
    const sensor_msgs::Image image = makeDepthImage(*frame, options);
    const ros::Time stamp = image.header.stamp;
    bag.write("/tf", stamp, makeTransform(*frame, options));
    bag.write(topic + "/camera_info", stamp, makeCameraInfo(image, frame->depth.intrinsics));
    bag.write(topic + "/image_rect", stamp, image);
    ++result.depth_images;
  }
  result.skipped = frames->skipped();
}

void writeColour(const TumToBagOptions& options, rosbag::Bag& bag, TumToBagResult& result) {
  for (const StampedImage& listed : readTumSequence(options.folder).colour) {
    const cv::Mat pixels = cv::imread(listed.path, cv::IMREAD_COLOR);
    if (pixels.empty()) throw std::runtime_error("cannot read '" + listed.path + "'");
    sensor_msgs::Image image;
    image.header = makeHeader(listed.stamp_s, options.camera_frame);
    image.width = static_cast<uint32_t>(pixels.cols);
    image.height = static_cast<uint32_t>(pixels.rows);
    image.encoding = enc::BGR8;
    image.step = image.width * 3;
    image.data.assign(pixels.datastart, pixels.dataend);
    bag.write(options.camera_namespace + "/rgb/image_rect_color", image.header.stamp, image);
    ++result.colour_images;
  }
}

}  // namespace

TumToBagResult convertTumToBag(const TumToBagOptions& options) {
  const std::string unfinished = options.bag + ".unfinished";
  TumToBagResult result;
  try {
    rosbag::Bag bag(unfinished, rosbag::bagmode::Write);
    bag.setCompression(rosbag::compression::LZ4);
    writeDepth(options, bag, result);
    writeColour(options, bag, result);
    bag.close();
    fs::rename(unfinished, options.bag);
  } catch (const rosbag::BagException& error) {
    fs::remove(unfinished);
    throw std::runtime_error("cannot write the bag '" + options.bag + "': " + error.what());
  } catch (...) {
    fs::remove(unfinished);
    throw;
  }
  return result;
}

}  // namespace dtsdf
