/// The way of an image through the node, from its topic to mesh, files, grid and distances: the
/// parts, the loops that they run in, and what services do to them.
#pragma once

#include <ros/node_handle.h>

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "params/node_params.h"
#include "ros/common/free_memory.h"
#include "ros/common/worker_thread.h"
#include "ros/input/cameras.h"
#include "ros/input/transforms.h"
#include "ros/output/mesh_output.h"
#include "ros/output/pose_publisher.h"
#include "ros/output/space_output.h"
#include "ros/output/status_report.h"
#include "ros/session/frame_poses.h"
#include "ros/session/levelling.h"
#include "ros/session/map_files.h"
#include "ros/session/map_session.h"
#include "ros/session/requests.h"

namespace dtsdf {

/// Four loops, each on its own thread and joined by queues: intake (transforms, order) -> map
/// (fuse, mesh) -> output (markers, points, files) and space (grid, distances). Thread safe. What
/// waits for a loop throws what the loop's work throws, and std::future_error once the loops have
/// stopped.
class MappingPipeline {
 public:
  /// Loads map/load_file, and then receives images.
  /// @throws ParamError or std::runtime_error if the node cannot start.
  MappingPipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~MappingPipeline();

  const MappingParams& params() const { return params_; }

  /// But for what is not the pipeline's.
  StatusInput status() const;

  void setRates(const PublishParams& rates);
  void setPaused(bool paused) { cameras_.setPaused(paused); }

  /// Where frames are in the map.
  const MapPoses& mapPoses() const { return map_poses_; }

  /// What was saved, and in what the mesh is not that of the map; empty: in nothing.
  struct SavedMeshFile {
    SavedMesh mesh;
    std::string note;
  };
  /// Waits for the map's thread and the output's.
  SavedMeshFile saveMesh(const std::string& path, const SaveChoice& choice);

  /// Wait for the map's thread, and for the file. One call at a time.
  MapFiles::Done saveMap(const std::string& path);
  MapFiles::Done loadMap(const std::string& path);

  /// Wait for the map's thread.
  void clearMap();
  ClearedRegion clearRegion(const Region& region);

  /// What planners may rely on; waits for nobody.
  /// @throws std::runtime_error if there is nothing; the text says why, and what to do.
  StampedSpace knownSpace() const;

  /// Moves frames of the map. The answer comes when that is done, on the map's thread.
  /// @param least See MapCorrection. @throws std::runtime_error where that is refused at once.
  void correctPoses(const GivenPoses& given, double least,
                    std::function<void(const CorrectionResult&)> answer);

  /// Has all of them answered that are under way.
  void giveUpCorrections(const std::string& reason);

  /// Waits for the map's thread. @throws std::runtime_error where poses/mode is tf.
  void setPose(const Eigen::Isometry3d& T_W_B);

  struct Trajectory {
    std::vector<StampedPose> poses;
    size_t left_out;  ///< Older ones that are no longer kept.
  };
  /// Of the frames fused. As setPose().
  Trajectory trajectory();

 private:
  void stop();
  void awaitOutputs();
  FramePoses& framePoses() const;
  std::vector<StampedPose> cameraPoses(const GivenPoses& given) const;
  void followPath(const GivenPoses& given);

  MappingParams params_;
  CallbackThread transforms_thread_;
  TransformBuffer transforms_;
  TransformInput transform_input_;
  PoseSource poses_;        ///< In map_frame.
  PoseSource image_poses_;  ///< In the frame that images' poses are given in.
  LevelTransform level_transform_;
  Levelling levelling_;
  ImuInput imu_input_;
  MapPoses map_poses_;
  std::unique_ptr<PosePublisher> pose_publisher_;  ///< Both null where poses/mode is tf.
  std::unique_ptr<FramePoses> frame_poses_;
  FrameQueue posed_frames_;
  FrameLedger ledger_;
  Cameras cameras_;

  MeshHandover mesh_changes_;
  MeshOutput output_;
  std::unique_ptr<MapLog> log_;  ///< Both null unless log/folder is set.
  std::unique_ptr<MapCorrection> correction_;
  SpaceHandover space_changes_;
  std::unique_ptr<SpaceOutput> space_output_;  ///< Null unless space/enabled.
  ViewPublisher views_;
  MapSession session_;

  FreeMemory free_memory_;  ///< For the output's thread, which has time.

  // Each is begun after those that it wakes.
  WorkerThread output_loop_, space_loop_, map_loop_, intake_loop_;
  MapFiles map_files_;
  CallbackThread path_thread_;
  std::unique_ptr<PathInput> path_input_;  ///< Null without a log.
};

}  // namespace dtsdf
