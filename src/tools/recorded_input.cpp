#include "tools/recorded_input.h"

#include <cstdio>
#include <stdexcept>
#include <utility>

#include "io/bag_frames.h"
#include "io/first_look.h"
#include "log/log_folder.h"

namespace dtsdf {
namespace {

/// Enough to see a wrong scale by.
constexpr size_t kFramesLookedAt = 5;

#ifdef DTSDF_WITH_BAG
BagOptions bagOptions(const InputOptions& options, const NodeParams& node) {
  BagOptions bag;
  bag.path = options.recording.path;
  bag.depth_topic = options.depth_topic;
  bag.info_topic = options.info_topic;
  bag.map_frame = node.map_frame;
  bag.camera_frame = node.input.camera_frame;
  bag.unit_16uc1_m = node.input.unit_16uc1_m;
  bag.unit_32fc1_m = node.input.unit_32fc1_m;
  bag.latest_camera_info = node.input.camera_info == CameraInfoChoice::kLatest;
  if (node.input.rectify != RectifyChoice::kAuto) {
    bag.rectify = node.input.rectify == RectifyChoice::kAlways;
  }
  bag.mask_topic = options.mask_topic;
  if (node.input.mask && bag.mask_topic.empty()) {
    throw UsageError("input/mask requires masks; give the bag's topic by --mask-topic");
  }
  bag.intrinsics = options.recording.intrinsics;
  bag.poses_path = options.recording.poses_path;
  bag.pose_tolerance_s = options.recording.pose_tolerance_s;
  bag.first_pose_only = options.recording.first_pose_only;
  bag.selection = options.recording.selection;
  bag.colour_topic = options.colour_topic;
  bag.imu_topic = options.imu_topic;
  bag.listed_colours = options.recording.listed_colours;
  return bag;
}

std::unique_ptr<FrameSource> openBag(const InputOptions& options, const NodeParams& node) {
  return openBagFrames(bagOptions(options, node));
}

std::unique_ptr<ColourSource> openColoursOfBag(const InputOptions& options,
                                               const NodeParams& node) {
  return openBagColours(bagOptions(options, node));
}

Eigen::Vector3d measuredUpOfBag(const InputOptions& options, const NodeParams& node) {
  return findUpInBag(bagOptions(options, node));
}
#else
std::unique_ptr<FrameSource> openBag(const InputOptions&, const NodeParams&) {
  throw std::runtime_error("this build cannot read bags; build the package with -DWITH_ROS=ON");
}

std::unique_ptr<ColourSource> openColoursOfBag(const InputOptions&, const NodeParams&) {
  return nullptr;
}

Eigen::Vector3d measuredUpOfBag(const InputOptions& options, const NodeParams& node) {
  openBag(options, node);  // throws
  return {};
}
#endif

}  // namespace

void completeInput(InputOptions& options) {
  std::string& format = options.recording.format;
  if (format.empty()) {
    const std::string& path = options.recording.path;
    format = isFrameLog(path) ? "log" : guessRecordingFormat(path);
  }
  checkReadingOptions(options);
}

std::unique_ptr<FrameSource> openFrames(const InputOptions& options, const NodeParams& node) {
  if (options.recording.format == "bag") return openBag(options, node);
  if (options.recording.format == "log") {
    throw std::runtime_error("'" + options.recording.path +
                             "' is a frame log, which only reconstruct reads");
  }
  return openRecording(options.recording);
}

std::unique_ptr<FrameSource> openAndLook(const InputOptions& options, const RunSettings& settings,
                                         const std::string& program) {
  LookedAt looked = lookAt(openFrames(options, settings.params.node), kFramesLookedAt);
  std::printf("%s: %s\n", options.recording.format.c_str(), describe(looked.look).c_str());
  static_cast<void>(std::fflush(stdout));  // now, wherever it goes
  const FusionParams& fusion = settings.params.mapper.fusion;
  for (const std::string& doubt : doubtsAbout(looked.look, static_cast<double>(fusion.min_depth_m),
                                              static_cast<double>(fusion.max_depth_m))) {
    std::fprintf(stderr, "%s: warning: %s\n", program.c_str(), doubt.c_str());
  }
  return std::move(looked.source);
}

Eigen::Vector3d measuredUp(const InputOptions& options, const NodeParams& node) {
  if (options.recording.format == "bag") return measuredUpOfBag(options, node);
  throw std::runtime_error("map/level is imu, which needs a bag with an inertial sensor; '" +
                           options.recording.path + "' is read as " + options.recording.format +
                           ": set map/level to floor or none");
}

std::string nameOfFrame(const InputOptions& options, const RunSettings& settings) {
  const bool is_named = options.recording.format == "bag" || settings.given.count("map_frame") > 0;
  return is_named ? settings.params.node.map_frame : std::string();
}

std::unique_ptr<ColourSource> openColours(const InputOptions& options, const NodeParams& node) {
  if (node.colour.enabled == ColourUse::kNever) return nullptr;
  const RecordingOptions& recording = options.recording;
  std::unique_ptr<ColourSource> colours =
      recording.format == "bag" ? openColoursOfBag(options, node) : openRecordingColours(recording);
  if (colours == nullptr && node.colour.enabled == ColourUse::kAlways) {
    throw std::runtime_error("colour/enabled is 'always', but '" + recording.path +
                             "' has no colour images where the format " + recording.format +
                             " has them");
  }
  return colours;
}

}  // namespace dtsdf
