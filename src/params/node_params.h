/// Settings of the node around the mapper: frames, input, what is published, where files go.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/params/mapper_params.h"
#include "dtsdf_mapping/params/param_set.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// Whether something is done.
enum class Usage {
  kAuto,  ///< Where what is received suggests it.
  kAlways,
  kNever,
};

struct InputParams {
  double merge_wait_s = 0.1;      ///< How long a frame waits for earlier ones of other cameras.
  std::string camera_frame;       ///< Camera's optical frame; empty: the frame_id of the images.
  int queue_size = 30;            ///< Images of one kind of a camera that may wait in the node.
  int queue_mb = 256;             ///< Memory that images may take while they wait, over all.
  double tf_timeout_s = 1.0;      ///< How long a frame waits for its transform at most.
  float unit_16uc1_m = 0.001f;    ///< Metres per unit of a 16UC1 image.
  float unit_32fc1_m = 1.0f;      ///< Metres per unit of a 32FC1 image.
  bool depth_along_ray = false;   ///< As some simulators have it; else along the optical axis.
  double max_speed_m_s = 10.0;    ///< A faster camera is a jump of its pose; 0: any speed is fine.
  double max_turn_deg_s = 720.0;  ///< A faster turn is a jump, too; 0: any is fine.
  /// An image gets the newest camera_info, for drivers that send it rarely; else that of its stamp.
  bool latest_camera_info = false;
  /// Images are rectified where they are distorted: kAuto, unless the topic's name says that they
  /// are rectified; kAlways, whatever its name.
  Usage rectify = Usage::kAuto;
  bool mask = false;  ///< Each image has a mask with its stamp, on `mask/image`.
};

/// Where up is known from, for maps whose map frame is not level.
enum class LevelChoice {
  kNone,   ///< The map is in map_frame.
  kFloor,  ///< From the floor that the first images show.
  kImu,    ///< From an inertial sensor at rest.
};

/// All settings of the node.
struct NodeParams {
  MapperParams mapper;

  std::string map_frame = "map";  ///< Frame that poses are of, and the map, unless it is levelled.
  LevelChoice level = LevelChoice::kNone;
  std::string level_frame;  ///< Frame of a levelled map; empty: map_frame and "_level".
  std::string load_file;    ///< Map to begin with; empty: none. "~/" is the home.
  std::string output_directory = "~/dtsdf_mapping";  ///< Root of saved files; "~/" is the home.
  std::vector<std::string> cameras;  ///< Their namespaces; empty: one camera in the node's own.
  std::string keep_frame;            ///< Centre of map/keep_radius_m; empty: the camera.
  PoseParams poses;
  /// With refine, the frame that TF's poses are in; its place in map_frame is what is published.
  /// With track, the parent of the base. Empty: map_frame.
  std::string odom_frame;
  std::string base_frame;  ///< Whose pose is published; empty: the depth camera's frame.
  InputParams input;
  Usage colour = Usage::kAuto;      ///< Colour images; kAlways: they have to be received.
  double max_colour_rate_hz = 0.0;  ///< Colour images per second, by their stamps; 0: all.

  int chunk_blocks = 4;          ///< Edge of a marker's chunk of the map, in blocks of 8 voxels.
  double mesh_rate_hz = 2.0;     ///< Maximum rate of `mesh`, in wall time.
  double points_rate_hz = 1.0;   ///< Maximum rate of `surface_points`, in wall time.
  double status_rate_hz = 1.0;   ///< Rate of `status` and the diagnostics, in wall time.
  double space_rate_hz = 1.0;    ///< Maximum rate of grid updates and slice, in wall time.
  double mesh_refresh_s = 60.0;  ///< The whole mesh is published once in so long; 0: not again.
  double stale_s = 5.0;  ///< What is silent for so long is warned about, three times so: an error.

  // What of space is published, by heights along z of the map frame, which has to be level for it.
  double min_height_m = 0.1;     ///< A column of the grid begins here.
  double max_height_m = 1.5;     ///< A column of the grid ends here.
  double grid_seen_share = 1.0;  ///< Share of a free column's cells that have to be seen free.
  double slice_height_m = 0.5;   ///< Height of the distances that are published.

  std::string journal_folder;    ///< Empty: there is none. "~/" is the home.
  double journal_max_gb = 16.0;  ///< Limit of the folder's journals, in 10^9 bytes; then it stops.

  // Corrections of poses that a SLAM publishes.
  std::string path_frame;  ///< Whose poses corrected_path has; empty: the depth camera's frame.
  double least_correction_m = 0.01;  ///< Nothing is done unless a frame moves as far, or as many
                                     ///< radians.
};

/// Whether the map is in a frame of its own, which is level.
inline bool isLevelled(const NodeParams& node) { return node.level != LevelChoice::kNone; }

/// The frame that images' poses are looked up in; empty: nowhere.
inline std::string frameOfPoses(const NodeParams& node) {
  if (node.poses.mode == PoseMode::kTrack) return "";
  const bool has_odom = node.poses.mode == PoseMode::kRefine && !node.odom_frame.empty();
  return has_odom ? node.odom_frame : node.map_frame;
}

/// The name of the frame that the map is in.
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
  visit("corrections/least_m", p.least_correction_m, Range{0.0, 1000.0});
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

/// Takes the leading slash of old tf off the frames' names, and checks those that a map may have.
/// For all who read settings: by the name of its frame a map is refused or taken.
void readFrames(NodeParams& node, ParamReader& reader);

/// Decides fusion/memory_frames where it is left open: aligned poses agree for longer.
void settleMemory(const PoseParams& poses, FusionParams& fusion);

/// A key and the rule it breaks.
using ParamViolation = std::pair<std::string, std::string>;

/// Reads the node's settings strictly. `violations` are found before, by whoever made the tree.
/// @throws ParamError with every violation.
NodeParams readNodeParams(const ParamTree& tree,
                          const std::vector<ParamViolation>& violations = {});

}  // namespace dtsdf
