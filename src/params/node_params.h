/// Settings of the node: its mapper, frames, input, topics and files.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/params/mapper_params.h"
#include "dtsdf_mapping/params/param_set.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// Whether a feature is used.
enum class Usage {
  kAuto,  ///< Used if the received messages suggest it.
  kAlways,
  kNever,
};

struct InputParams {
  double merge_wait_s = 0.1;     ///< Maximum wait for an earlier frame from another camera.
  std::string camera_frame;      ///< The camera's optical frame; empty: the frame_id of the images.
  int queue_size = 30;           ///< Maximum number of waiting images, per camera and type.
  int queue_mb = 256;            ///< Maximum memory of all waiting images.
  double tf_timeout_s = 1.0;     ///< Maximum time that a frame waits for its transform.
  float unit_16uc1_m = 0.001f;   ///< Metres per unit of a 16UC1 image.
  float unit_32fc1_m = 1.0f;     ///< Metres per unit of a 32FC1 image.
  bool depth_along_ray = false;  ///< Depth is along the ray (some simulators), not the axis.
  double max_speed_m_s = 10.0;   ///< Faster motion counts as a pose jump; 0: no limit.
  double max_turn_deg_s = 720.0;  ///< Faster turns count as a pose jump; 0: no limit.
  /// Uses the newest camera_info, not the one with the image's stamp, for drivers that send it
  /// rarely.
  bool latest_camera_info = false;
  /// Whether to rectify distorted images. kAuto: unless the topic's name indicates that they
  /// already are.
  Usage rectify = Usage::kAuto;
  bool mask = false;  ///< Whether to use masks: one per image, with its stamp, on `mask/image`.
};

/// How a map is levelled, if the map frame is not level.
enum class LevelChoice {
  kNone,   ///< The map is not levelled: it is in map_frame.
  kFloor,  ///< It is levelled with the floor in the first images.
  kImu,    ///< It is levelled with an inertial sensor at rest.
};

/// All settings of the node.
struct NodeParams {
  MapperParams mapper;

  std::string map_frame = "map";  ///< Frame of the poses, and of a map that is not levelled.
  LevelChoice level = LevelChoice::kNone;
  std::string level_frame;  ///< Frame of a levelled map; empty: map_frame and "_level".
  std::string load_file;    ///< Map to load at startup, named as in load_map; empty: none.
  std::string output_directory = "~/dtsdf_mapping";  ///< Root folder for saved files.
  std::vector<std::string> cameras;  ///< Namespaces; empty: one camera in the node's namespace.
  std::string keep_frame;  ///< Frame on which map/keep_radius_m is centred; empty: the camera.
  PoseParams poses;
  /// With poses/mode refine: the frame of the poses in TF, whose transform to map_frame is
  /// published. With poses/mode track: the parent of base_frame. Empty: map_frame.
  std::string odom_frame;
  std::string base_frame;  ///< Frame whose pose is published; empty: the depth camera's frame.
  InputParams input;
  Usage colour = Usage::kAuto;      ///< Whether to use colour images; kAlways: they are required.
  double max_colour_rate_hz = 0.0;  ///< Maximum rate of colour images by their stamps; 0: all.

  int chunk_blocks = 4;          ///< Edge of a chunk of the published mesh, in blocks.
  double mesh_rate_hz = 2.0;     ///< Maximum rate of `mesh`, in wall time.
  double points_rate_hz = 1.0;   ///< Maximum rate of `surface_points`, in wall time.
  double status_rate_hz = 1.0;   ///< Rate of `status` and the diagnostics, in wall time.
  double space_rate_hz = 1.0;    ///< Maximum rate of grid updates and the slice, in wall time.
  double mesh_refresh_s = 60.0;  ///< Interval at which the whole mesh is published again; 0: never.
  double stale_s = 5.0;          ///< Time without a fused depth image before a warning; an error
                                 ///< after three times that.

  // How the free-space grid is published. Heights are along z of the map frame, which must be
  // level.
  double min_height_m = 0.1;     ///< Lower end of the grid's columns.
  double max_height_m = 1.5;     ///< Upper end of the grid's columns.
  double grid_seen_share = 1.0;  ///< Fraction of a free column's cells that must be free.
  double slice_height_m = 0.5;   ///< Height of the published slice of distances.

  std::string journal_folder;    ///< Folder of the journals; empty: no journal.
  double journal_max_gb = 16.0;  ///< Maximum total size of the journals, in 10^9 bytes.

  // Corrections of poses from a SLAM system.
  std::string
      path_frame;  ///< Frame whose poses corrected_path contains; empty: the depth camera's.
  double min_correction_m = 0.01;  ///< Paths that move no image by this much, in metres or
                                   ///< radians, are ignored.
};

/// Whether the map is levelled, so that it has its own frame.
inline bool isLevelled(const NodeParams& node) { return node.level != LevelChoice::kNone; }

/// Frame in which the images' poses are looked up; empty: poses are not looked up.
inline std::string frameOfPoses(const NodeParams& node) {
  if (node.poses.mode == PoseMode::kTrack) return "";
  const bool has_odom = node.poses.mode == PoseMode::kRefine && !node.odom_frame.empty();
  return has_odom ? node.odom_frame : node.map_frame;
}

/// Name of the map's frame.
inline std::string frameOfMap(const NodeParams& node) {
  if (!isLevelled(node)) return node.map_frame;
  return node.level_frame.empty() ? node.map_frame + "_level" : node.level_frame;
}

template <class Visitor>
void visitParams(NodeParams& p, Visitor& visit) {
  visitParams(p.mapper, visit);
  visit("map_frame", p.map_frame);
  visit("map/level", p.level,
        EnumNames<LevelChoice>{{"none", LevelChoice::kNone},
                               {"floor", LevelChoice::kFloor},
                               {"imu", LevelChoice::kImu}});
  visit("map/level_frame", p.level_frame);
  visit("map/load_file", p.load_file);
  visit("output_directory", p.output_directory);
  visit("cameras", p.cameras);
  visit("map/keep_frame", p.keep_frame);
  visitParams(p.poses, visit);
  visit("poses/odom_frame", p.odom_frame);
  visit("poses/base_frame", p.base_frame);
  visit("input/merge_wait_s", p.input.merge_wait_s, Range{0.0, 60.0});
  visit("input/camera_frame", p.input.camera_frame);
  visit("input/queue_size", p.input.queue_size, Range{1, 10000});
  visit("input/queue_mb", p.input.queue_mb, Range{1, 65536});
  visit("input/tf_timeout_s", p.input.tf_timeout_s, Range{0.0, 3600.0});
  visit("input/unit_16uc1_m", p.input.unit_16uc1_m, Range{1e-6, 1.0});
  visit("input/unit_32fc1_m", p.input.unit_32fc1_m, Range{1e-6, 1000.0});
  visit("input/depth", p.input.depth_along_ray, EnumNames<bool>{{"axis", false}, {"ray", true}});
  visit("input/max_speed_m_s", p.input.max_speed_m_s, Range{0.0, 1e6});
  visit("input/max_turn_deg_s", p.input.max_turn_deg_s, Range{0.0, 1e6});
  const EnumNames<Usage> usages{
      {"auto", Usage::kAuto}, {"always", Usage::kAlways}, {"never", Usage::kNever}};
  visit("colour/enabled", p.colour, usages);
  visit("colour/max_rate_hz", p.max_colour_rate_hz, Range{0.0, 1000.0});
  visit("input/camera_info", p.input.latest_camera_info,
        EnumNames<bool>{{"exact", false}, {"latest", true}});
  visit("input/rectify", p.input.rectify, usages);
  visit("input/mask", p.input.mask);
  visit("journal/folder", p.journal_folder);
  visit("journal/max_gb", p.journal_max_gb, Range{0.1, 1e6});
  visit("corrections/path_frame", p.path_frame);
  visit("corrections/least_m", p.min_correction_m, Range{0.0, 1000.0});
  visit("publish/chunk_blocks", p.chunk_blocks, Range{1, 64});
  visit("publish/mesh_rate_hz", p.mesh_rate_hz, Range{0.01, 100.0});
  visit("publish/points_rate_hz", p.points_rate_hz, Range{0.01, 100.0});
  visit("publish/status_rate_hz", p.status_rate_hz, Range{0.01, 100.0});
  visit("publish/space_rate_hz", p.space_rate_hz, Range{0.01, 100.0});
  visit("mesh_topics/refresh_s", p.mesh_refresh_s, Range{0.0, 1e6});
  visit("status/stale_s", p.stale_s, Range{0.0, 1e6});
  visit("space/min_height_m", p.min_height_m, Range{-1e4, 1e4});
  visit("space/max_height_m", p.max_height_m, Range{-1e4, 1e4});
  visit("space/grid_seen_share", p.grid_seen_share, Range{0.0, 1.0});
  visit("space/slice_height_m", p.slice_height_m, Range{-1e4, 1e4});
}

/// Strips the leading slash, which old tf used, from frame names, and checks the map's frames. Call
/// this whenever settings are read, since map frames are compared by name.
void readFrames(NodeParams& node, ParamReader& reader);

/// If poses are aligned and fusion/memory_frames is 0, sets it to the value for aligned poses.
void resolveMemoryFrames(const PoseParams& poses, FusionParams& fusion);

/// A key and the rule it breaks.
using ParamViolation = std::pair<std::string, std::string>;

/// Reads and checks the node's settings.
/// @throws ParamError with every violation, including `violations`, which the caller has found.
NodeParams readNodeParams(const ParamTree& tree,
                          const std::vector<ParamViolation>& violations = {});

}  // namespace dtsdf
