#include "ros/session/mapping_node.h"

#include <ros/console.h>

#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "ros/common/callback_guard.h"
#include "ros/common/param_server.h"
#include "ros/output/mesh_saver.h"

namespace dtsdf {
namespace {

MappingParams readParams(const ros::NodeHandle& private_nh) {
  const ServerParams server = readParamServer(private_nh);
  return readMappingParams(server.tree, server.violations);
}

ros::NodeHandle withQueue(ros::NodeHandle nh, ros::CallbackQueue& queue) {
  nh.setCallbackQueue(&queue);
  return nh;
}

}  // namespace

MappingNode::MappingNode(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : params_(readParams(private_nh)),
      service_nh_(withQueue(private_nh, service_queue_)),
      poses_(nh, params_.node.map_frame),
      intake_(params_.node.input, poses_, accounting_),
      mesh_publisher_(service_nh_,
                      {params_.node.map_frame, params_.mapper.mesh.colour,
                       params_.node.publish.chunk_blocks},
                      [this](const auto& newcomer) { onNewcomer(newcomer); }),
      points_publisher_(service_nh_, params_.node.map_frame, params_.mapper.mesh.colour),
      session_(params_, {intake_, accounting_, mesh_publisher_, points_publisher_}),
      worker_([this] { return session_.step(); }),
      service_spinner_(1, &service_queue_) {
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "backend: " << session_.report().backend << ", voxels of "
                                                     << params_.mapper.map.voxel_size_m << " m");
  advertiseServices();
  service_spinner_.start();
  camera_ = std::make_unique<CameraInput>(
      nh, private_nh, accounting_, [this](const auto& image, const auto& info) {
        intake_.push(image, info);
        worker_.wake();
      });
  status_ = std::make_unique<StatusPublisher>(
      nh, private_nh,
      StatusPublisher::Options{params_.node.map_frame, params_.node.publish.status_rate_hz},
      [this] { return collectStatus(); });
}

MappingNode::~MappingNode() {
  // From the outside in: nothing may call into a part that is gone. Whoever waits for the worker
  // is served before the worker ends.
  status_.reset();
  camera_.reset();
  save_mesh_.shutdown();
  clear_map_.shutdown();
  pause_.shutdown();
  service_spinner_.stop();
  worker_.stop();
}

void MappingNode::advertiseServices() {
  save_mesh_ = service_nh_.advertiseService("save_mesh", &MappingNode::onSaveMesh, this);
  clear_map_ = service_nh_.advertiseService("clear_map", &MappingNode::onClearMap, this);
  pause_ = service_nh_.advertiseService("pause", &MappingNode::onPause, this);
}

StatusInput MappingNode::collectStatus() const {
  StatusInput input;
  input.frames = accounting_.counts();
  input.map = session_.report();
  input.paused = intake_.paused();
  input.frames_waiting = intake_.size();
  input.waiting_for = intake_.waitingFor();
  input.image_topic = camera_->imageTopic();
  input.info_topic = camera_->infoTopic();
  input.image_publishers = camera_->imagePublishers();
  input.mesh_listeners = mesh_publisher_.listeners();
  input.max_map_bytes = static_cast<uint64_t>(params_.mapper.map.max_memory_mb) << 20;
  return input;
}

void MappingNode::onNewcomer(const ros::SingleSubscriberPublisher& newcomer) {
  // Sent by the worker, so that no change published meanwhile is overtaken by an older mesh.
  worker_.run([&] { session_.publishAll(newcomer); }).get();
}

bool MappingNode::onSaveMesh(dtsdf_mapping::SaveMesh::Request& request,
                             dtsdf_mapping::SaveMesh::Response& response) {
  try {
    const std::string path = resolveMeshPath(params_.node.output_directory, request.file_name);
    const Mesh mesh = worker_.run([this] { return session_.currentMesh(); }).get();
    saveMesh(mesh, params_.mapper.mesh.colour, path);
    response.success = true;
    response.path = path;
    response.vertices = mesh.vertices_m.size();
    response.triangles = mesh.triangles.size();
    response.message = "saved " + std::to_string(response.triangles) + " triangles to " + path;
    ROS_INFO_STREAM_NAMED("dtsdf_mapping", response.message);
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", "save_mesh: " << response.message);
  }
  return true;
}

bool MappingNode::onClearMap(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  response.success =
      guarded("clear_map", [this] { worker_.run([this] { session_.clear(); }).get(); });
  response.message = response.success ? "the map is empty" : "failed; the log says why";
  return true;
}

bool MappingNode::onPause(std_srvs::SetBool::Request& request,
                          std_srvs::SetBool::Response& response) {
  response.success = guarded("pause", [&] { intake_.setPaused(request.data != 0); });
  response.message = request.data ? "paused: frames are dropped" : "mapping";
  return true;
}

}  // namespace dtsdf
