#include "ros/session/mapping_pipeline.h"

#include <ros/console.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "params/printable.h"
#include "ros/common/node_start.h"
#include "ros/input/published_topics.h"
#include "ros/session/requests.h"

namespace dtsdf {
namespace {

const char kOnlyByTf[] = "frames can be moved only where poses/mode is tf";

/// How long the loop of space sleeps where there is none.
constexpr std::chrono::hours kNoSpace{1};

void warnOfRefusedPath(const std::string& reason) {
  ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", "corrected_path is refused: " << reason);
}

MappingParams readParams(const ros::NodeHandle& private_nh) {
  const ServerParams server = readParamServer(private_nh);
  MappingParams params = readMappingParams(server.tree, server.violations);
  std::string& page_folder = params.mapper.map.page_folder;
  page_folder = expandHome(page_folder, "map/page_folder");
  return params;
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

}  // namespace

MappingPipeline::MappingPipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
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
      cameras_(nh, private_nh, params_.node,
               {image_poses_, posed_frames_, ledger_, [this] { intake_loop_.wake(); }}),
      mesh_changes_([this] { output_loop_.wake(); }),
      output_(private_nh, params_, mesh_changes_),
      log_(params_.node.log.folder.empty()
               ? nullptr
               : std::make_unique<MapLog>(
                     params_, expandHome(params_.node.log.folder, "log/folder"), levelling_)),
      correction_(log_ && !frame_poses_ ? std::make_unique<MapCorrection>(*log_, params_.mapper)
                                        : nullptr),
      space_changes_([this] { space_loop_.wake(); }),
      space_output_(params_.mapper.space.enabled
                        ? std::make_unique<SpaceOutput>(private_nh, params_, space_changes_)
                        : nullptr),
      views_(private_nh, std::chrono::steady_clock::now),
      session_(makeMapper(params_.mapper), meshRate(params_.node.publish),
               {posed_frames_, ledger_, mesh_changes_, [this] { return output_.hasListeners(); },
                [this](const ros::Time& stamp) { return map_poses_.keepCenterAt(stamp); },
                space_output_ ? &space_changes_ : nullptr, &levelling_, frame_poses_.get(),
                log_.get(), correction_.get(), &views_}),
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
    ROS_INFO_STREAM_NAMED("dtsdf_mapping", printableMessage(loadMap(path).message));
  }
  cameras_.subscribe(private_nh);
  if (log_ && !correction_) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", "corrected_path is not subscribed: " << kOnlyByTf);
  }
  if (!correction_) return;
  path_input_ = std::make_unique<PathInput>(
      path_thread_.serve(nh), namespaceOf(private_nh) + "/corrected_path",
      params_.node.corrections.path_frame, [this](const GivenPoses& given) { followPath(given); },
      [this](const std::string& reason) {
        correction_->noteRefused(reason);
        map_loop_.run([reason] { warnOfRefusedPath(reason); });  // that is throttled on one thread
      });
  path_thread_.start();
}

MappingPipeline::~MappingPipeline() { stop(); }

void MappingPipeline::stop() {
  cameras_.unsubscribe();
  path_thread_.stop();
  transforms_thread_.stop();
  map_files_.stop();
  intake_loop_.stop();
  map_loop_.stop();
  space_loop_.stop();
  output_loop_.stop();
}

StatusInput MappingPipeline::status() const {
  StatusInput input;
  input.cameras = cameras_.report();
  input.map = session_.report();
  input.output = output_.report();
  if (space_output_) space_output_->addTo(input.output);
  input.transforms = transforms_.report();
  if (log_) input.log = log_->report();
  if (correction_) {
    input.correction = correction_->report();
    input.correction.obstacle = whyTooLarge(input.map.stats);
  }
  if (frame_poses_) {
    input.poses = frame_poses_->report();
    input.poses.problem = pose_publisher_->problem();
  }
  input.paused = cameras_.paused();
  input.stale_s = params_.node.status.stale_s;
  if (std::any_of(input.cameras.begin(), input.cameras.end(), lacksInput)) {
    input.topics = findPublishedTopics();
  }
  if (input.map.voxel_size_m == 0.0f) input.map.voxel_size_m = params_.mapper.map.voxel_size_m;
  input.max_image_bytes = queueBytesOf(params_.node.input);
  input.max_queue_bytes = queueBytesOf(params_.node.publish);
  return input;
}

void MappingPipeline::setRates(const PublishParams& rates) {
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

MappingPipeline::SavedMeshFile MappingPipeline::saveMesh(const std::string& path,
                                                         const SaveChoice& choice) {
  // Part by part, so that they need not be in memory at once; no frame comes between them, which
  // would bring more.
  const auto bring = [this] {
    MapSession::BroughtMesh brought;
    do {
      brought = session_.bringMeshUpToDate();
      output_loop_.run([this] { output_.takeChanges(); }).get();
    } while (brought.is_part);
    return brought;
  };
  const MapSession::BroughtMesh brought = map_loop_.run(bring).get();
  return {output_loop_.run([&] { return output_.save(path, choice); }).get(), brought.problem};
}

MapFiles::Done MappingPipeline::saveMap(const std::string& path) { return map_files_.save(path); }

MapFiles::Done MappingPipeline::loadMap(const std::string& path) {
  MapFiles::Done done = map_files_.load(path);
  // The camera may be anywhere in the map that was loaded.
  intake_loop_.run([this] { cameras_.restartMotion(); }).get();
  awaitOutputs();
  returnFreeMemory();  // that of the old map
  return done;
}

void MappingPipeline::clearMap() {
  map_loop_.run([this] { session_.clear(); }).get();
  awaitOutputs();
  returnFreeMemory();
}

ClearedRegion MappingPipeline::clearRegion(const Region& region) {
  return map_loop_.run([&] { return session_.clearRegion(region); }).get();
}

/// In the map, of the camera.
std::vector<StampedPose> MappingPipeline::cameraPoses(const GivenPoses& given) const {
  const Eigen::Isometry3d T_W_F = map_poses_.find(given.frame_id);
  Eigen::Isometry3d T_B_C = Eigen::Isometry3d::Identity();
  if (!given.child_frame.empty()) {
    const std::string camera = correction_->report().camera_frame;
    if (camera.empty()) throw std::runtime_error("no frame has been received yet");
    const PoseAnswer mount = poses_.findIn(given.child_frame, camera);
    if (mount.kind != PoseAnswer::Kind::kKnown) throw std::runtime_error(mount.text);
    T_B_C = mount.T_W_C;
  }
  std::vector<StampedPose> poses;
  poses.reserve(given.poses.size());
  for (const StampedPose& pose : given.poses) {
    poses.push_back({pose.stamp_s, T_W_F * pose.T_W_C * T_B_C});
  }
  return poses;
}

void MappingPipeline::correctPoses(const GivenPoses& given, double least,
                                   std::function<void(const CorrectionResult&)> answer) {
  if (frame_poses_) throw std::runtime_error(kOnlyByTf);
  if (!correction_) {
    throw std::runtime_error(
        "frames can be moved only if they are logged; start the node with log/folder");
  }
  MapCorrection::Request request{cameraPoses(given), least, std::move(answer)};
  map_loop_.run([&] { session_.correct(std::move(request)); }).get();
}

void MappingPipeline::followPath(const GivenPoses& given) {
  correctPoses(given, params_.node.corrections.least_m, [](const CorrectionResult& result) {
    if (result.success && result.moved > 0) {
      ROS_INFO_STREAM_NAMED("dtsdf_mapping", "corrected_path: " << result.message);
    } else if (!result.success) {
      warnOfRefusedPath(result.message);
    }
  });
}

void MappingPipeline::giveUpCorrections(const std::string& reason) {
  if (correction_) map_loop_.run([&] { correction_->giveUp(reason); }).get();
}

/// Once this has returned, nothing of the map of before is published or answered any more.
void MappingPipeline::awaitOutputs() {
  output_loop_.run([this] { output_.takeChanges(); }).get();
  if (space_output_) space_loop_.run([this] { space_output_->takeChanges(); }).get();
}

StampedSpace MappingPipeline::knownSpace() const {
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

FramePoses& MappingPipeline::framePoses() const {
  if (frame_poses_) return *frame_poses_;
  throw std::runtime_error(
      "poses come from TF as they are; start the node with poses/mode: track, "
      "or refine");
}

void MappingPipeline::setPose(const Eigen::Isometry3d& T_W_B) {
  FramePoses& poses = framePoses();
  map_loop_.run([&] { poses.setPose(T_W_B); }).get();
}

MappingPipeline::Trajectory MappingPipeline::trajectory() {
  const FramePoses& poses = framePoses();
  return map_loop_
      .run([&] {
        return Trajectory{poses.fusedPoses().copy(), poses.fusedPoses().leftOut()};
      })
      .get();
}

}  // namespace dtsdf
