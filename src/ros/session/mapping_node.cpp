#include "ros/session/mapping_node.h"

#include <ros/console.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "params/printable.h"
#include "ros/common/callback_guard.h"
#include "ros/common/param_server.h"
#include "ros/input/depth_topics.h"
#include "ros/output/output_path.h"
#include "ros/session/answer.h"
#include "ros/session/distance_request.h"
#include "ros/session/region_request.h"

namespace dtsdf {
namespace {

/// How long the loop of space sleeps where there is none.
constexpr std::chrono::hours kNoSpace{1};

MappingParams readParams(const ros::NodeHandle& private_nh) {
  const ServerParams server = readParamServer(private_nh);
  return readMappingParams(server.tree, server.violations);
}

MeshOutput::Options outputOptions(const MappingParams& params) {
  const PublishParams& publish = params.node.publish;
  return {params.mapper.map.voxel_size_m, params.mapper.mesh.colour, publish.mesh_rate_hz,
          publish.points_rate_hz, static_cast<size_t>(publish.max_queue_mb) << 20};
}

/// What a call of save_mesh asks for. @throws std::runtime_error if that cannot be.
SaveChoice readSaveChoice(const dtsdf_mapping::SaveMesh::Request& request,
                          const Eigen::Isometry3d& T_W_F) {
  SaveChoice choice;
  choice.region = readBox(request.region);
  if (choice.region) choice.region->T_W_B = T_W_F * choice.region->T_W_B;
  choice.simplify_error_m = request.simplify_error_m;
  if (!(choice.simplify_error_m >= 0.0) || std::isinf(choice.simplify_error_m)) {
    throw std::runtime_error("simplify_error_m must be a number of metres, or 0");
  }
  return choice;
}

/// The mesh is extracted for listeners as often as one of its two topics may need it.
double meshRate(const PublishParams& publish) {
  return std::max(publish.mesh_rate_hz, publish.points_rate_hz);
}

std::unique_ptr<PosePublisher> makePosePublisher(const ros::NodeHandle& private_nh,
                                                 const NodeParams& params,
                                                 const TransformBuffer& transforms) {
  if (params.poses.mode == PoseMode::kTf) return nullptr;
  return std::make_unique<PosePublisher>(private_nh, params, transforms);
}

std::unique_ptr<FramePoses> makeFramePoses(const NodeParams& params, const PoseSource& poses,
                                           const Levelling& levelling, PosePublisher* publisher) {
  if (publisher == nullptr) return nullptr;
  return std::make_unique<FramePoses>(
      params, poses, &levelling,
      FramePoses::Listeners{[publisher](const FoundPose& pose) { publisher->publish(pose); },
                            [publisher](const ros::Time& stamp, const Eigen::Isometry3d& T_M_O) {
                              publisher->publishCorrection(stamp, T_M_O);
                            },
                            [publisher] { publisher->clearPath(); }});
}

std::unique_ptr<SpaceOutput> makeSpaceOutput(const ros::NodeHandle& private_nh,
                                             const MappingParams& params, SpaceHandover& handover) {
  if (!params.mapper.space.enabled) return nullptr;
  const GroundParams& ground = params.node.ground;
  return std::make_unique<SpaceOutput>(
      private_nh,
      SpaceOutput::Options{frameOfMap(params.node),
                           {ground.min_height_m, ground.max_height_m, ground.grid_seen_share},
                           ground.slice_height_m,
                           params.mapper.space.max_distance_m,
                           params.node.publish.space_rate_hz},
      handover);
}

}  // namespace

MappingNode::MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
    : params_(readParams(private_nh)),
      transforms_({params_.node.input.tf_max_ahead_s}),
      transform_input_(transforms_thread_.serve(nh), transforms_),
      poses_(transforms_, params_.node.map_frame),
      image_poses_(transforms_, frameOfPoses(params_.node)),
      level_transform_(params_.node.map_frame, frameOfMap(params_.node)),
      levelling_(params_, image_poses_,
                 [this](const Eigen::Isometry3d& T_W_M) { level_transform_.publish(T_W_M); }),
      imu_input_(transforms_thread_.serve(nh), namespaceOf(private_nh), params_.node, levelling_),
      map_poses_(params_, poses_, levelling_),
      pose_publisher_(makePosePublisher(private_nh, params_.node, transforms_)),
      frame_poses_(makeFramePoses(params_.node, poses_, levelling_, pose_publisher_.get())),
      posed_frames_(params_.node.input.merge_wait_s, [this] { map_loop_.wake(); }),
      cameras_(nh, private_nh, params_.node, image_poses_, posed_frames_,
               [this] { intake_loop_.wake(); }),
      mesh_publisher_(private_nh, {frameOfMap(params_.node), params_.mapper.mesh.colour,
                                   params_.node.publish.chunk_blocks}),
      points_publisher_(private_nh, frameOfMap(params_.node), params_.mapper.mesh.colour),
      mesh_changes_([this] { output_loop_.wake(); }),
      output_(outputOptions(params_), {mesh_changes_, mesh_publisher_, points_publisher_}),
      space_changes_([this] { space_loop_.wake(); }),
      space_output_(makeSpaceOutput(private_nh, params_, space_changes_)),
      session_(
          makeMapper(params_.mapper), meshRate(params_.node.publish),
          {posed_frames_, mesh_changes_,
           [this] { return mesh_publisher_.hasListeners() || points_publisher_.hasListeners(); },
           [this](const ros::Time& stamp) { return map_poses_.keepCenterAt(stamp); },
           space_output_ ? &space_changes_ : nullptr, &levelling_, frame_poses_.get()}),
      free_memory_(std::chrono::steady_clock::now),
      output_loop_(
          [this] {
            free_memory_.step();
            return output_.step();
          },
          WorkerThread::Priority::kLow),
      space_loop_([this] { return space_output_ ? space_output_->step() : kNoSpace; }),
      map_loop_([this] { return session_.step(); }),
      intake_loop_([this] { return cameras_.step(); }),
      map_files_(params_.mapper, params_.node.map_frame, {session_, map_loop_}) {
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "backend: " << session_.report().backend << ", voxels of "
                                                     << params_.mapper.map.voxel_size_m << " m");
  // By the loop, which is at work already.
  map_loop_.run([this] { session_.setSpaceRate(params_.node.publish.space_rate_hz); });
  transforms_thread_.start();
  if (!params_.node.load_file.empty()) {
    const std::string path = expandHome(params_.node.load_file, "map/load_file");
    ROS_INFO_STREAM_NAMED("dtsdf_mapping", printableMessage(loadMapFile(path).message));
  }
  advertiseServices(private_nh);
  cameras_.subscribe(private_nh);
  master_watch_ = std::make_unique<MasterWatch>(pause_.getService());
  status_ = std::make_unique<StatusPublisher>(
      nh, private_nh,
      StatusPublisher::Options{frameOfMap(params_.node), params_.node.publish.status_rate_hz},
      [this] { return collectStatus(); });
  rates_ = std::make_unique<RateServer>(private_nh, params_.node.publish,
                                        [this](const PublishParams& rates) { setRates(rates); });
  // Last, so that nobody waits for a loop that a failing constructor has ended.
  save_thread_.start();
  clear_thread_.start();
  query_thread_.start();
}

MappingNode::~MappingNode() {
  // From the outside in: nothing may call into a part that is gone. Whoever waits for a loop is
  // served before the loop ends.
  ++saves_;  // whoever simplifies a mesh gives up
  rates_.reset();
  status_.reset();
  master_watch_.reset();
  cameras_.unsubscribe();
  save_mesh_.shutdown();
  clear_region_.shutdown();
  save_map_.shutdown();
  load_map_.shutdown();
  clear_map_.shutdown();
  get_distances_.shutdown();
  pause_.shutdown();
  pose_services_->shutdown();
  transforms_thread_.stop();
  save_thread_.stop();
  clear_thread_.stop();
  query_thread_.stop();
  map_files_.stop();
  intake_loop_.stop();
  map_loop_.stop();
  space_loop_.stop();
  output_loop_.stop();
}

void MappingNode::advertiseServices(ros::NodeHandle private_nh) {
  save_mesh_ =
      save_thread_.serve(private_nh).advertiseService("save_mesh", &MappingNode::onSaveMesh, this);
  clear_region_ = clear_thread_.serve(private_nh)
                      .advertiseService("clear_region", &MappingNode::onClearRegion, this);
  save_map_ =
      save_thread_.serve(private_nh).advertiseService("save_map", &MappingNode::onSaveMap, this);
  load_map_ =
      save_thread_.serve(private_nh).advertiseService("load_map", &MappingNode::onLoadMap, this);
  clear_map_ =
      clear_thread_.serve(private_nh).advertiseService("clear_map", &MappingNode::onClearMap, this);
  get_distances_ = query_thread_.serve(private_nh)
                       .advertiseService("get_distances", &MappingNode::onGetDistances, this);
  pause_ = private_nh.advertiseService("pause", &MappingNode::onPause, this);
  pose_services_ = std::make_unique<PoseServices>(
      clear_thread_.serve(private_nh), params_.node.output_directory,
      PoseServices::Parts{frame_poses_.get(), map_poses_, map_loop_});
}

StatusInput MappingNode::collectStatus() const {
  StatusInput input;
  input.cameras = cameras_.report();
  input.map = session_.report();
  input.output = output_.report();
  if (space_output_) space_output_->addTo(input.output);
  input.transforms = transforms_.report();
  if (frame_poses_) {
    input.poses = frame_poses_->report();
    input.poses.problem = pose_publisher_->problem();
  }
  input.paused = cameras_.paused();
  input.master = master_watch_->problem();
  input.stale_s = params_.node.status.stale_s;
  if (std::any_of(input.cameras.begin(), input.cameras.end(), hasNoPublisher)) {
    input.depth_topics = findDepthTopics();
  }
  input.mesh_listeners = mesh_publisher_.listeners();
  if (input.map.voxel_size_m == 0.0f) input.map.voxel_size_m = params_.mapper.map.voxel_size_m;
  input.max_image_bytes = queueBytesOf(params_.node.input);
  input.max_queue_bytes = static_cast<uint64_t>(params_.node.publish.max_queue_mb) << 20;
  return input;
}

void MappingNode::setRates(const PublishParams& rates) {
  status_->setRate(rates.status_rate_hz);
  // Nobody waits: each loop takes its rate between two steps.
  map_loop_.run([this, rates] {
    session_.setMeshRate(meshRate(rates));
    session_.setSpaceRate(rates.space_rate_hz);
  });
  output_loop_.run([this, rates] { output_.setRates(rates.mesh_rate_hz, rates.points_rate_hz); });
  if (space_output_) {
    space_loop_.run([this, rates] { space_output_->setRate(rates.space_rate_hz); });
  }
}

bool MappingNode::onSaveMesh(dtsdf_mapping::SaveMesh::Request& request,
                             dtsdf_mapping::SaveMesh::Response& response) {
  const uint64_t number = ++saves_;
  const std::lock_guard<std::mutex> turn(saving_);
  answer("save_mesh", response, [&] {
    const std::string path =
        resolveOutputPath(params_.node.output_directory, request.file_name, meshExtensions());
    SaveChoice choice = readSaveChoice(request, map_poses_.find(request.frame_id));
    choice.go_on = [&](double) { return saves_ == number; };
    const std::string note = map_loop_.run([this] { return session_.bringMeshUpToDate(); }).get();
    const SavedMesh saved = output_loop_.run([&] { return output_.save(path, choice); }).get();
    response.path = path;
    response.vertices = saved.vertices;
    response.triangles = saved.triangles;
    response.error_m = saved.error_m;
    response.message = "saved " + std::to_string(response.triangles) + " triangles to " + path;
    if (choice.simplify_error_m != 0.0) {
      response.message += ", at most " + std::to_string(saved.error_m) + " m from the whole mesh";
    }
    if (!saved.loss.empty()) response.message += "; " + saved.loss;
    response.message += note;
  });
  return true;
}

bool MappingNode::onClearRegion(dtsdf_mapping::ClearRegion::Request& request,
                                dtsdf_mapping::ClearRegion::Response& response) {
  answer("clear_region", response, [&] {
    const Region region =
        inMap(readRegion(request.box, request.sphere), map_poses_.find(request.frame_id));
    const ClearedRegion cleared = map_loop_.run([&] { return session_.clearRegion(region); }).get();
    response.voxels = cleared.voxels;
    response.blocks = cleared.blocks;
    response.message = "emptied " + std::to_string(cleared.voxels) + " voxels, freed " +
                       std::to_string(cleared.blocks) + " blocks";
  });
  return true;
}

bool MappingNode::onGetDistances(dtsdf_mapping::GetDistances::Request& request,
                                 dtsdf_mapping::GetDistances::Response& response) {
  answer("get_distances", response, [&] {
    checkPoints(request.points);
    const Eigen::Isometry3d T_W_F = map_poses_.find(request.header.frame_id, request.header.stamp);
    const StampedSpace known = knownSpace();
    fillAnswer(*known.space, inMap(request.points, T_W_F), T_W_F, response);
    response.stamp = known.stamp;
  });
  return true;
}

/// @throws std::runtime_error where there is none that a planner may rely on.
StampedSpace MappingNode::knownSpace() const {
  if (!space_output_) {
    throw std::runtime_error(
        "the map does not record free space; start the node with "
        "space/enabled");
  }
  session_.throwIfFailed();  // the last frame may be in the map in part
  StampedSpace known = space_output_->newest();
  if (known.space->isEmpty()) {
    throw std::runtime_error(
        "nothing is mapped yet since the start, clear_map or load_map; ask "
        "again once a frame was fused and meshed");
  }
  return known;
}

bool MappingNode::onSaveMap(dtsdf_mapping::SaveMap::Request& request,
                            dtsdf_mapping::SaveMap::Response& response) {
  ++saves_;
  const std::lock_guard<std::mutex> turn(saving_);
  answer("save_map", response, [&] {
    response.path =
        resolveOutputPath(params_.node.output_directory, request.file_name, {kMapExtension});
    const MapFiles::Done done = map_files_.save(response.path);
    response.blocks = done.blocks;
    response.message = done.message;
  });
  return true;
}

bool MappingNode::onLoadMap(dtsdf_mapping::LoadMap::Request& request,
                            dtsdf_mapping::LoadMap::Response& response) {
  ++saves_;
  const std::lock_guard<std::mutex> turn(saving_);
  answer("load_map", response, [&] {
    response.path =
        resolveOutputPath(params_.node.output_directory, request.file_name, {kMapExtension});
    const MapFiles::Done done = loadMapFile(response.path);
    response.blocks = done.blocks;
    response.message = done.message;
  });
  return true;
}

MapFiles::Done MappingNode::loadMapFile(const std::string& path) {
  MapFiles::Done done = map_files_.load(path);
  // The camera may be anywhere in the map that was loaded.
  intake_loop_.run([this] { cameras_.restartMotion(); }).get();
  awaitOutputs();
  returnFreeMemory();  // that of the old map
  return done;
}

/// Once this has returned, nothing of the map of before is published or answered any more.
void MappingNode::awaitOutputs() {
  output_loop_.run([this] { output_.takeChanges(); }).get();
  if (space_output_) space_loop_.run([this] { space_output_->takeChanges(); }).get();
}

bool MappingNode::onClearMap(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  response.success = guarded("clear_map", [this] {
    map_loop_.run([this] { session_.clear(); }).get();
    awaitOutputs();
    returnFreeMemory();
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
