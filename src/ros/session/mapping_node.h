/// The mapping node: wires its parts together and answers its services.
#pragma once

#include <dtsdf_mapping/SaveMesh.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <memory>

#include "ros/input/camera_input.h"
#include "ros/output/status_publisher.h"
#include "ros/session/map_session.h"
#include "ros/session/worker_thread.h"

namespace dtsdf {

/// The same for the nodelet and the node. Three kinds of threads: the one(s) of the caller's node
/// handles take images and publish the status; the worker owns the map; one of our own answers
/// services and newcomers, which wait for the worker.
class MappingNode {
 public:
  /// @throws ParamError or std::runtime_error if the node cannot start.
  MappingNode(ros::NodeHandle nh, ros::NodeHandle private_nh);
  ~MappingNode();

 private:
  void advertiseServices();
  StatusInput collectStatus() const;
  void onNewcomer(const ros::SingleSubscriberPublisher& newcomer);
  bool onSaveMesh(dtsdf_mapping::SaveMesh::Request& request,
                  dtsdf_mapping::SaveMesh::Response& response);
  bool onClearMap(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool onPause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);

  MappingParams params_;
  ros::CallbackQueue service_queue_;
  ros::NodeHandle service_nh_;

  FrameAccounting accounting_;
  PoseSource poses_;
  FrameIntake intake_;
  MeshPublisher mesh_publisher_;
  SurfacePointsPublisher points_publisher_;
  MapSession session_;
  WorkerThread worker_;
  std::unique_ptr<CameraInput> camera_;
  std::unique_ptr<StatusPublisher> status_;
  ros::ServiceServer save_mesh_, clear_map_, pause_;
  ros::AsyncSpinner service_spinner_;
};

}  // namespace dtsdf
