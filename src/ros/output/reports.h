/// What the status reports about map, mesh, log and poses while the node runs.
#pragma once

#include <ros/time.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/mapper.h"
#include "page/paged_meshes.h"
#include "page/paged_values.h"
#include "ros/output/listener_topic.h"

namespace dtsdf {

/// What the status reports about the map.
struct MapReport {
  std::string backend;
  std::string failure;        ///< Of the backend; empty while it works.
  std::string loaded_map;     ///< The file that the map was loaded from; empty: none.
  float voxel_size_m = 0.0f;  ///< Of a map that was loaded; 0: as the settings say.
  MapStats stats;
  MapperMemory memory;
  double integrate_ms = 0.0, paint_ms = 0.0, mesh_ms = 0.0;
};

/// How a correction of poses goes.
struct CorrectionReport {
  size_t waiting = 0;           ///< Those that are not answered yet.
  size_t fused = 0, total = 0;  ///< Frames fused again, and all of them; 0 while none are.
  size_t bytes = 0;             ///< Of the map that is made.
  std::string last;             ///< What became of the last one; empty: there was none.
  std::string obstacle;         ///< Why one that came now would be refused; empty: nothing known.
  std::string camera_frame;     ///< Of the first camera's images.
};

/// What the status reports about the output.
struct OutputReport {
  size_t triangles = 0;             ///< Of the mesh as it was handed over last.
  size_t mesh_bytes = 0;            ///< What it keeps in memory,
  size_t max_mesh_bytes = 0;        ///< at most, with map/page_folder; 0: no limit.
  PagedMeshes::Stats paged_meshes;  ///< What it keeps on disk.
  size_t space_bytes = 0;  ///< What is kept of space for planners: cells, distances, the grid.
  PagedValues::Stats paged_space;  ///< What of these lies on disk.
  double publish_ms = 0.0;
  std::vector<TopicStatus> topics;        ///< Of the mesh; what waits there has a limit.
  std::vector<TopicStatus> space_topics;  ///< Empty without space/enabled.
};

constexpr int kAlignmentStatusCount = static_cast<int>(AlignmentStatus::kUnsure) + 1;

/// How the depth images of one camera fit the map.
struct CameraPoseReport {
  std::optional<Alignment> last;                         ///< Of the newest image.
  ros::Time stamp;                                       ///< Of that one.
  std::vector<Eigen::Vector3d> free_shifts, free_turns;  ///< See freeAxes().
  std::optional<double> lost_since_s;  ///< First image that did not fit; none: followed.
  std::array<uint64_t, kAlignmentStatusCount> outcomes{};  ///< Images, by AlignmentStatus.
};

struct PoseReport {
  std::vector<CameraPoseReport> cameras;  ///< In their order; empty where poses/mode is tf.
  std::string problem;                    ///< Why poses are not on /tf; empty: they are.
  size_t trajectory_bytes = 0, max_trajectory_bytes = 0;
};

}  // namespace dtsdf
