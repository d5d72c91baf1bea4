/// tum_to_bag DIR OUT.bag: a TUM RGB-D folder as a bag for rosbag play and `reconstruct --bag`.
#include <cv_bridge/cv_bridge.h>
#include <rosbag/bag.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <set>
#include <stdexcept>

#include "dtsdf_mapping/io/recording.h"
#include "program/command_line.h"
#include "program/run_program.h"
#include "ros/input/conversions.h"
#include "ros/input/images.h"

namespace dtsdf {
namespace {

struct TumToBagOptions {
  RecordingOptions recording;
  std::string bag;
  double units_per_metre = 5000.0;
  /// 16UC1 in millimetres, as many drivers send it: half the size, but TUM's 0.2 mm are rounded.
  bool millimetres = false;
  std::string map_frame = "map";
  std::string camera_frame = "camera_depth_optical_frame";
  std::string camera_namespace = "/camera";
};

namespace fs = std::filesystem;
namespace enc = sensor_msgs::image_encodings;

std_msgs::Header makeHeader(double stamp_s, const std::string& frame) {
  std_msgs::Header header;
  header.stamp.fromSec(stamp_s);
  header.frame_id = frame;
  return header;
}

/// 32FC1 holds raw * unit as the mapper would compute it, so nothing is lost.
sensor_msgs::ImagePtr makeDepthImage(const SourceFrame& frame, const TumToBagOptions& options) {
  const DepthFrame& depth = frame.depth;
  const cv::Mat_<uint16_t> raws(depth.height, depth.width,
                                static_cast<uint16_t*>(const_cast<void*>(depth.data)),
                                depth.row_bytes);
  cv_bridge::CvImage image(makeHeader(frame.stamp_s, options.camera_frame), enc::TYPE_32FC1);
  if (options.millimetres) {
    image.encoding = enc::TYPE_16UC1;
    raws.convertTo(image.image, CV_16UC1, 1000.0 / options.units_per_metre);
    image.image.setTo(0, image.image == kNoDepth16);  // too far for it
  } else {
    cv::Mat_<float> pixels(raws.size());
    std::transform(raws.begin(), raws.end(), pixels.begin(),
                   [&](uint16_t raw) { return raw * depth.unit_m; });
    image.image = pixels;
  }
  return image.toImageMsg();
}

sensor_msgs::ImagePtr makeColourImage(const SourceColour& source, const TumToBagOptions& options) {
  const ColourFrame& colour = source.colour;
  const cv::Mat pixels(colour.height, colour.width, CV_8UC3, const_cast<void*>(colour.data),
                       colour.row_bytes);
  return cv_bridge::CvImage(makeHeader(source.stamp_s, options.camera_frame), enc::RGB8, pixels)
      .toImageMsg();
}

/// Each image with its transform, at the stamp at which the offline program would fuse it.
class BagWriter {
 public:
  /// @throws std::runtime_error for a folder that cannot be read.
  BagWriter(const TumToBagOptions& options, const std::string& path)
      : options_(options), bag_(path, rosbag::bagmode::Write) {
    bag_.setCompression(rosbag::compression::LZ4);
    const std::unique_ptr<FrameSource> frames = openRecording(options.recording);
    while (const std::optional<SourceFrame> frame = frames->next()) {
      write("depth", "image_rect", makeDepthImage(*frame, options), frame->depth);
    }
    count(frames->skipped());
    const std::unique_ptr<ColourSource> images = openRecordingColours(options.recording);
    if (images == nullptr) return;
    while (const std::optional<SourceColour> image = images->next()) {
      write("rgb", "image_rect_color", makeColourImage(*image, options), image->colour);
    }
    count(images->skipped());
  }

  void close() { bag_.close(); }

  void report() {
    std::cout << options_.bag << ": " << written_["depth"] << " depth images, " << written_["rgb"]
              << " colour images\n";
    for (const auto& [reason, number] : skipped_) {
      std::cout << "left out: " << number << " depth images (" << reason << ")\n";
    }
  }

 private:
  template <class Frame>
  void write(const std::string& kind, const std::string& name, const sensor_msgs::ImagePtr& image,
             const Frame& frame) {
    const ros::Time stamp = image->header.stamp;
    const std::string ns = options_.camera_namespace + "/" + kind + "/";
    if (posed_.insert(stamp).second) {  // tf2 warns about poses that repeat
      tf2_msgs::TFMessage message;
      message.transforms.push_back(
          makeTransform(options_.map_frame, options_.camera_frame, frame.T_W_C, stamp));
      bag_.write("/tf", stamp, message);
    }
    bag_.write(ns + "camera_info", stamp, makeCameraInfo(*image, frame.intrinsics));
    bag_.write(ns + name, stamp, image);
    ++written_[kind];
  }

  void count(const std::map<std::string, size_t>& skipped) {
    for (const auto& [reason, number] : skipped) skipped_[reason] += number;
  }

  const TumToBagOptions& options_;
  rosbag::Bag bag_;
  std::set<ros::Time> posed_;
  std::map<std::string, size_t> written_, skipped_;
};

/// The bag is written beside its place and renamed when it is whole.
/// @throws std::runtime_error for a folder that cannot be read or a bag that cannot be written.
void convert(const TumToBagOptions& options) {
  const std::string unfinished = options.bag + ".unfinished";
  try {
    BagWriter writer(options, unfinished);
    writer.close();
    fs::rename(unfinished, options.bag);
    writer.report();
  } catch (const rosbag::BagException& error) {
    fs::remove(unfinished);
    throw std::runtime_error("cannot write the bag '" + options.bag + "': " + error.what());
  } catch (...) {
    fs::remove(unfinished);
    throw;
  }
}

TumToBagOptions readOptions(const std::vector<std::string>& arguments) {
  TumToBagOptions options;
  options.recording.format = "tum";
  CommandLine line("tum_to_bag", "DIR OUT.bag [options]",
                   "Writes a bag with NAMESPACE/depth/image_rect and camera_info, "
                   "NAMESPACE/rgb/image_rect_color and camera_info (if the folder has colour "
                   "images), and /tf from the map frame to the camera's optical frame.");
  line.addText({"DIR", "", "the folder"}, options.recording.path);
  line.addText({"OUT.bag", "", "the bag"}, options.bag);
  line.addNumber({"--depth-scale", "UNITS", "units per metre of the folder's depth images"},
                 options.units_per_metre, {kAboveZero, kUnbounded});
  line.addFlag("--millimetres", "depth as 16UC1 in mm, rounded (default: 32FC1 in m, lossless)",
               options.millimetres);
  line.addText({"--map-frame", "FRAME", "frame of the map"}, options.map_frame);
  line.addText({"--camera-frame", "FRAME", "the camera's optical frame"}, options.camera_frame);
  line.addText({"--camera", "NAMESPACE", "namespace of the topics"}, options.camera_namespace);
  line.parse(arguments);
  options.recording.units_per_metre = options.units_per_metre;
  return options;
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("tum_to_bag", argc, argv, dtsdf::readOptions, dtsdf::convert);
}
