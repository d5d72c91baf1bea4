/// The mapping node: wires its parts together and answers its services.
#pragma once

#include <dtsdf_mapping/ClearRegion.h>
#include <dtsdf_mapping/GetDistances.h>
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>
#include <ros/node_handle.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "params/node_params.h"
#include "ros/common/free_memory.h"
#include "ros/common/steady_clock.h"
#include "ros/common/worker_thread.h"
#include "ros/input/cameras.h"
#include "ros/input/transform_input.h"
#include "ros/output/mesh_output.h"
#include "ros/output/pose_publisher.h"
#include "ros/output/space_output.h"
#include "ros/output/status_publisher.h"
#include "ros/session/callback_thread.h"
#include "ros/session/frame_poses.h"
#include "ros/session/level_input.h"
#include "ros/session/levelling.h"
#include "ros/session/map_files.h"
#include "ros/session/map_poses.h"
#include "ros/session/map_session.h"
#include "ros/session/master_watch.h"
#include "ros/session/pose_services.h"
#include "ros/session/rate_server.h"

namespace dtsdf {

/// The same for the nodelet and the node. Four loops, each on its own thread and joined by queues:
/// intake (transforms, order) -> map (fuse, mesh) -> output (markers, points, files) and space
/// (grid, distances). The thread(s)
/// of the caller's node handles take images, publish the status and pause; callbacks that wait for
/// a loop have threads of their own.
class MappingNode {
 public:
  /// @throws ParamError or std::runtime_error if the node cannot start.
  MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~MappingNode();

 private:
  void advertiseServices(ros::NodeHandle private_nh);
  StatusInput collectStatus() const;
  void setRates(const PublishParams& rates);
  bool onSaveMesh(dtsdf_mapping::SaveMesh::Request& request,
                  dtsdf_mapping::SaveMesh::Response& response);
  bool onClearRegion(dtsdf_mapping::ClearRegion::Request& request,
                     dtsdf_mapping::ClearRegion::Response& response);
  bool onGetDistances(dtsdf_mapping::GetDistances::Request& request,
                      dtsdf_mapping::GetDistances::Response& response);
  StampedSpace knownSpace() const;
  void awaitOutputs();
  bool onSaveMap(dtsdf_mapping::SaveMap::Request& request,
                 dtsdf_mapping::SaveMap::Response& response);
  bool onLoadMap(dtsdf_mapping::LoadMap::Request& request,
                 dtsdf_mapping::LoadMap::Response& response);
  MapFiles::Done loadMapFile(const std::string& path);
  bool onClearMap(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool onPause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);

  MappingParams params_;
  CallbackThread save_thread_{2}, clear_thread_, query_thread_, transforms_thread_;
  std::mutex saving_;               ///< What saves or loads goes one after the other,
  std::atomic<uint64_t> saves_{0};  ///< and knows by this that another one waits.

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
  Cameras cameras_;

  MeshPublisher mesh_publisher_;
  SurfacePointsPublisher points_publisher_;
  MeshHandover mesh_changes_;
  MeshOutput output_;
  SpaceHandover space_changes_;
  std::unique_ptr<SpaceOutput> space_output_;  ///< Null unless space/enabled.
  MapSession session_;

  FreeMemory free_memory_;  ///< For the output's thread, which has time.

  // Each is begun after those that it wakes.
  WorkerThread output_loop_, space_loop_, map_loop_, intake_loop_;
  MapFiles map_files_;

  std::unique_ptr<PoseServices> pose_services_;
  std::unique_ptr<MasterWatch> master_watch_;
  std::unique_ptr<StatusPublisher> status_;
  std::unique_ptr<RateServer> rates_;
  ros::ServiceServer save_mesh_, save_map_, load_map_, clear_region_, clear_map_, pause_;
  ros::ServiceServer get_distances_;
};

}  // namespace dtsdf
