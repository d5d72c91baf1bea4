#include "ros/session/mapping_node.h"

#include <ros/console.h>

#include <algorithm>
#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/common/param_server.h"
#include "ros/input/depth_topics.h"
#include "ros/output/mesh_saver.h"

namespace dtsdf {
namespace {

/// For how long transforms are kept: longer than any frame waits in a queue that keeps up.
constexpr double kTransformsKept_s = 30.0;

MappingParams readParams(const ros::NodeHandle& private_nh) {
  const ServerParams server = readParamServer(private_nh);
  return readMappingParams(server.tree, server.violations);
}

MeshOutput::Options outputOptions(const MappingParams& params) {
  const PublishParams& publish = params.node.publish;
  return {params.mapper.map.voxel_size_m, params.mapper.mesh.colour, publish.mesh_rate_hz,
          publish.points_rate_hz};
}

/// The mesh is extracted as often as one of its two topics may need it.
double meshRate(const PublishParams& publish) {
  return std::max(publish.mesh_rate_hz, publish.points_rate_hz);
}

}  // namespace

MappingNode::MappingNode(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : params_(readParams(private_nh)),
      transforms_(ros::Duration(kTransformsKept_s)),
      transform_listener_(transforms_, nh, true),
      poses_(transforms_, params_.node.map_frame),
      posed_frames_(params_.node.input.merge_wait_s, [this] { map_loop_.wake(); }),
      cameras_(nh, private_nh, params_.node, poses_, posed_frames_,
               [this] { intake_loop_.wake(); }),
      mesh_publisher_(newcomers_thread_.serve(private_nh),
                      {params_.node.map_frame, params_.mapper.mesh.colour,
                       params_.node.publish.chunk_blocks},
                      [this](const auto& newcomer) { onNewcomer(newcomer); }),
      points_publisher_(newcomers_thread_.serve(private_nh), params_.node.map_frame,
                        params_.mapper.mesh.colour),
      mesh_changes_([this] { output_loop_.wake(); }),
      output_(outputOptions(params_), {mesh_changes_, mesh_publisher_, points_publisher_}),
      session_(makeMapper(params_.mapper), meshRate(params_.node.publish),
               {posed_frames_, mesh_changes_,
                [this] {
                  return mesh_publisher_.hasListeners() || points_publisher_.hasListeners();
                }}),
      output_loop_([this] { return output_.step(); }, WorkerThread::Priority::kLow),
      map_loop_([this] { return session_.step(); }),
      intake_loop_([this] { return cameras_.step(); }) {
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "backend: " << session_.report().backend << ", voxels of "
                                                     << params_.mapper.map.voxel_size_m << " m");
  advertiseServices(private_nh);
  cameras_.subscribe(private_nh);
  status_ = std::make_unique<StatusPublisher>(
      nh, private_nh,
      StatusPublisher::Options{params_.node.map_frame, params_.node.publish.status_rate_hz},
      [this] { return collectStatus(); });
  rates_ = std::make_unique<RateServer>(private_nh, params_.node.publish,
                                        [this](const PublishParams& rates) { setRates(rates); });
  // Last, so that nobody waits for a loop that a failing constructor has ended.
  newcomers_thread_.start();
  save_thread_.start();
  clear_thread_.start();
}

MappingNode::~MappingNode() {
  // From the outside in: nothing may call into a part that is gone. Whoever waits for a loop is
  // served before the loop ends.
  rates_.reset();
  status_.reset();
  cameras_.unsubscribe();
  save_mesh_.shutdown();
  clear_map_.shutdown();
  pause_.shutdown();
  newcomers_thread_.stop();
  save_thread_.stop();
  clear_thread_.stop();
  intake_loop_.stop();
  map_loop_.stop();
  output_loop_.stop();
}

void MappingNode::advertiseServices(ros::NodeHandle private_nh) {
  save_mesh_ = save_thread_.serve(private_nh)
                   .advertiseService("save_mesh", &MappingNode::onSaveMesh, this);
  clear_map_ = clear_thread_.serve(private_nh)
                   .advertiseService("clear_map", &MappingNode::onClearMap, this);
  pause_ = private_nh.advertiseService("pause", &MappingNode::onPause, this);
}

StatusInput MappingNode::collectStatus() const {
  StatusInput input;
  input.cameras = cameras_.report();
  input.map = session_.report();
  input.output = output_.report();
  input.paused = cameras_.paused();
  if (std::any_of(input.cameras.begin(), input.cameras.end(), hasNoPublisher)) {
    input.depth_topics = findDepthTopics();
  }
  input.mesh_listeners = mesh_publisher_.listeners();
  input.max_map_bytes = static_cast<uint64_t>(params_.mapper.map.max_memory_mb) << 20;
  return input;
}

void MappingNode::setRates(const PublishParams& rates) {
  status_->setRate(rates.status_rate_hz);
  // Nobody waits: each loop takes its rate between two steps.
  map_loop_.run([this, rates] { session_.setMeshRate(meshRate(rates)); });
  output_loop_.run(
      [this, rates] { output_.setRates(rates.mesh_rate_hz, rates.points_rate_hz); });
}

void MappingNode::onNewcomer(const ros::SingleSubscriberPublisher& newcomer) {
  map_loop_.wake();  // someone listens now
  // Sent by the output's loop, so that no change published meanwhile is overtaken by an older mesh.
  output_loop_.run([&] { output_.publishAll(newcomer); }).get();
}

bool MappingNode::onSaveMesh(dtsdf_mapping::SaveMesh::Request& request,
                             dtsdf_mapping::SaveMesh::Response& response) {
  try {
    const std::string path = resolveMeshPath(params_.node.output_directory, request.file_name);
    map_loop_.run([this] { session_.bringMeshUpToDate(); }).get();
    const SavedMesh saved = output_loop_.run([&] { return output_.save(path); }).get();
    response.success = true;
    response.path = path;
    response.vertices = saved.vertices;
    response.triangles = saved.triangles;
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
  response.success = guarded("clear_map", [this] {
    map_loop_.run([this] { session_.clear(); }).get();
    // Once this has returned, nothing of the old mesh is on its way to a topic any more.
    output_loop_.run([this] { output_.takeChanges(); }).get();
  });
  response.message = response.success ? "the map is empty" : "failed; the log says why";
  return true;
}

bool MappingNode::onPause(std_srvs::SetBool::Request& request,
                          std_srvs::SetBool::Response& response) {
  response.success = guarded("pause", [&] { cameras_.setPaused(request.data != 0); });
  response.message = request.data ? "paused: frames are dropped" : "mapping";
  return true;
}

}  // namespace dtsdf
