#include "params/node_params.h"

#include <cctype>
#include <set>

#include "params/param_copy.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// Whether a name is a valid namespace of ROS topics: parts separated by slashes, each consisting
/// of a letter followed by letters, digits and underscores.
bool isNamespace(const std::string& name) {
  bool begins = true;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (begins ? !std::isalpha(byte) : !std::isalnum(byte) && c != '_' && c != '/') return false;
    begins = c == '/';
  }
  return !begins;
}

void checkCameras(const NodeParams& node, ParamReader& reader) {
  for (const std::string& name : node.cameras) {
    if (isNamespace(name)) continue;
    reader.addViolation("cameras", "'" + name +
                                       "' is not a valid namespace; use letters, digits, _ and "
                                       "/, starting with a letter");
  }
  if (std::set<std::string>(node.cameras.begin(), node.cameras.end()).size() <
      node.cameras.size()) {
    reader.addViolation("cameras", "must all have different names");
  }
  if (node.cameras.size() > 1 && !node.input.camera_frame.empty()) {
    reader.addViolation("input/camera_frame",
                        "works with a single camera only; leave it empty: with several cameras, "
                        "the frames of their images are used");
  }
}

/// Checks that the frames differ, since a frame in TF has only one parent.
void checkPoseFrames(const NodeParams& node, ParamReader& reader) {
  const std::string& odom = node.odom_frame;
  const std::string& base = node.base_frame;
  const auto isMap = [&](const std::string& frame) {
    return !frame.empty() && (frame == node.map_frame || frame == frameOfMap(node));
  };
  if (isMap(odom)) {
    reader.addViolation("poses/odom_frame",
                        "must differ from the map's frame; leave it empty for poses in map_frame");
  }
  if (isMap(base)) reader.addViolation("poses/base_frame", "must differ from the map's frame");
  if (!base.empty() && base == odom) {
    reader.addViolation("poses/base_frame", "must differ from poses/odom_frame");
  }
}

void checkPoses(const NodeParams& node, ParamReader& reader) {
  checkPoseFrames(node, reader);
  if (node.poses.mode != PoseMode::kTrack) return;
  if (node.cameras.size() > 1) {
    reader.addViolation("poses/mode",
                        "is track, which follows a single camera, but "
                        "`cameras` lists several; use refine, or one camera");
  }
  if (node.level == LevelChoice::kImu) {
    reader.addViolation("map/level",
                        "cannot be imu when poses/mode is track, since there is no "
                        "transform to the sensor yet; use floor");
  }
}

}  // namespace

void resolveMemoryFrames(const PoseParams& poses, FusionParams& fusion) {
  // With 20, a removed surface could take more than 28 frames to vanish, since voxels that
  // a frame does not cover are checked only in every fourth frame.
  constexpr int kFramesOfAlignedPoses = 19;
  if (fusion.memory_frames > 0 || poses.mode == PoseMode::kTf) return;
  fusion.memory_frames = kFramesOfAlignedPoses;
}

void readFrames(NodeParams& node, ParamReader& reader) {
  for (std::string* name :
       {&node.map_frame, &node.level_frame, &node.keep_frame, &node.input.camera_frame,
        &node.odom_frame, &node.base_frame, &node.path_frame}) {
    *name = stripLeadingSlash(*name);
  }
  if (node.map_frame.empty()) reader.addViolation("map_frame", "must not be empty");
  if (isLevelled(node) && node.level_frame == node.map_frame) {
    reader.addViolation("map/level_frame", "must differ from map_frame, the frame of the poses");
  }
}

NodeParams readNodeParams(const ParamTree& tree, const std::vector<ParamViolation>& violations) {
  NodeParams node;
  ParamReader reader(copyOf(tree));
  visitParams(node, reader);
  checkParams(node.mapper, reader);
  for (const auto& [key, rule] : violations) reader.addViolation(key, rule);
  readFrames(node, reader);
  if (node.output_directory.empty()) reader.addViolation("output_directory", "must not be empty");
  if (node.min_height_m >= node.max_height_m) {
    reader.addViolation("space/min_height_m", "must be less than space/max_height_m");
  }
  checkCameras(node, reader);
  checkPoses(node, reader);
  reader.finish();
  resolveMemoryFrames(node.poses, node.mapper.fusion);
  return node;
}

}  // namespace dtsdf
