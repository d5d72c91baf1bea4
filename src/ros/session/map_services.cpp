#include "ros/session/map_services.h"

#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <stdexcept>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "io/trajectory.h"
#include "ros/session/requests.h"

namespace dtsdf {
namespace {

/// How often who waits for a correction looks whether the node ends.
constexpr std::chrono::milliseconds kLookForTheEnd(100);

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

}  // namespace

MapServices::MapServices(const ros::NodeHandle& private_nh, MappingPipeline& pipeline)
    : pipeline_(pipeline) {
  advertiseFiles(save_thread_.serve(private_nh));
  advertiseMap(clear_thread_.serve(private_nh));
  servers_.push_back(advertise<dtsdf_mapping::GetDistances>(
      query_thread_.serve(private_nh), "get_distances",
      [this](const auto& request, auto& response) { getDistances(request, response); }));
  servers_.push_back(advertise<dtsdf_mapping::CorrectPoses>(
      correct_thread_.serve(private_nh), "correct_poses",
      [this](const auto& request, auto& response) { correctPoses(request, response); }));
  servers_.push_back(advertise<std_srvs::SetBool>(
      private_nh, "pause", [this](const auto& request, auto& response) {
        pipeline_.setPaused(request.data != 0);
        response.message = request.data ? "paused: frames are dropped" : "mapping";
      }));
}

MapServices::~MapServices() {
  is_ending_ = true;  // before a service waits for its last answer
  ++saves_;           // whoever simplifies a mesh gives up
  for (ros::ServiceServer& server : servers_) server.shutdown();
  pipeline_.giveUpCorrections("the node ends");
  correct_thread_.stop();
  save_thread_.stop();
  clear_thread_.stop();
  query_thread_.stop();
}

void MapServices::start() {
  save_thread_.start();
  clear_thread_.start();
  query_thread_.start();
  correct_thread_.start();
}

/// One after the other; a mesh that is being simplified gives up for the next one.
void MapServices::advertiseFiles(const ros::NodeHandle& nh) {
  const auto inTurn = [this](auto answer) {
    return [this, answer](const auto& request, auto& response) {
      const uint64_t number = ++saves_;
      const std::lock_guard<std::mutex> turn(saving_);
      turn_ = number;
      answer(request, response);
    };
  };
  const auto ofMap = [this](MapFileWork work) {
    return
        [this, work](const auto& request, auto& response) { withMapFile(request, response, work); };
  };
  using namespace dtsdf_mapping;
  servers_.push_back(advertise<SaveMesh>(
      nh, "save_mesh",
      inTurn([this](const auto& request, auto& response) { saveMesh(request, response); })));
  servers_.push_back(advertise<SaveMap>(nh, "save_map", inTurn(ofMap(&MappingPipeline::saveMap))));
  servers_.push_back(advertise<LoadMap>(nh, "load_map", inTurn(ofMap(&MappingPipeline::loadMap))));
}

void MapServices::advertiseMap(const ros::NodeHandle& nh) {
  using namespace dtsdf_mapping;
  servers_.push_back(
      advertise<std_srvs::Trigger>(nh, "clear_map", [this](const auto&, auto& response) {
        pipeline_.clearMap();
        response.message = "the map is empty";
      }));
  servers_.push_back(advertise<ClearRegion>(
      nh, "clear_region",
      [this](const auto& request, auto& response) { clearRegion(request, response); }));
  servers_.push_back(
      advertise<SetPose>(nh, "set_pose", [this](const auto& request, auto& response) {
        pipeline_.setPose(pipeline_.mapPoses().find(request.frame_id) * readPose(request.pose));
        response.message = "the next depth image is tracked from there";
      }));
  servers_.push_back(advertise<SaveTrajectory>(
      nh, "save_trajectory",
      [this](const auto& request, auto& response) { saveTrajectory(request, response); }));
}

std::string MapServices::outputPath(const std::string& file_name,
                                    const std::vector<std::string>& extensions) const {
  return resolveOutputPath(pipeline_.params().node.output_directory, file_name, extensions);
}

void MapServices::saveMesh(const dtsdf_mapping::SaveMesh::Request& request,
                           dtsdf_mapping::SaveMesh::Response& response) {
  const std::string path = outputPath(request.file_name, meshExtensions());
  SaveChoice choice = readSaveChoice(request, pipeline_.mapPoses().find(request.frame_id));
  choice.go_on = [this, number = turn_](double) { return saves_ == number; };
  const MappingPipeline::SavedMeshFile saved = pipeline_.saveMesh(path, choice);
  response.path = path;
  response.vertices = saved.mesh.vertices;
  response.triangles = saved.mesh.triangles;
  response.error_m = saved.mesh.error_m;
  response.message = "saved " + std::to_string(response.triangles) + " triangles to " + path;
  if (choice.simplify_error_m != 0.0) {
    response.message +=
        ", at most " + std::to_string(saved.mesh.error_m) + " m from the whole mesh";
  }
  if (!saved.mesh.loss.empty()) response.message += "; " + saved.mesh.loss;
  response.message += saved.note;
}

template <class Request, class Response>
void MapServices::withMapFile(const Request& request, Response& response, MapFileWork work) {
  response.path = outputPath(request.file_name, {kMapExtension});
  const MapFiles::Done done = (pipeline_.*work)(response.path);
  response.blocks = done.blocks;
  response.message = done.message;
}

void MapServices::saveTrajectory(const dtsdf_mapping::SaveTrajectory::Request& request,
                                 dtsdf_mapping::SaveTrajectory::Response& response) {
  const MappingPipeline::Trajectory trajectory = pipeline_.trajectory();
  const std::string path = outputPath(request.file_name, {".txt", ".tum"});
  if (trajectory.poses.empty()) {
    throw std::runtime_error(
        "there is no pose yet: no frame has been fused since the start, "
        "clear_map or load_map");
  }
  dtsdf::saveTrajectory(trajectory.poses, path);
  response.path = path;
  response.poses = trajectory.poses.size();
  response.message = "saved " + std::to_string(trajectory.poses.size()) + " poses to " + path;
  if (trajectory.left_out > 0) {
    response.message +=
        "; " + std::to_string(trajectory.left_out) + " older ones are no longer kept";
  }
}

void MapServices::clearRegion(const dtsdf_mapping::ClearRegion::Request& request,
                              dtsdf_mapping::ClearRegion::Response& response) {
  const Region region =
      inMap(readRegion(request.box, request.sphere), pipeline_.mapPoses().find(request.frame_id));
  const ClearedRegion cleared = pipeline_.clearRegion(region);
  response.voxels = cleared.voxels;
  response.blocks = cleared.blocks;
  response.message = "emptied " + std::to_string(cleared.voxels) + " voxels, freed " +
                     std::to_string(cleared.blocks) + " blocks";
}

void MapServices::correctPoses(const dtsdf_mapping::CorrectPoses::Request& request,
                               dtsdf_mapping::CorrectPoses::Response& response) {
  const std::string path = outputPath(request.file_name, {".txt", ".tum"});
  GivenPoses given;
  given.poses = readTrajectory(path, "give a TUM file in output_directory").poses();
  given.frame_id = request.frame_id;
  given.child_frame = request.child_frame;
  const auto done = std::make_shared<std::promise<CorrectionResult>>();
  std::future<CorrectionResult> answer = done->get_future();
  pipeline_.correctPoses(given, 0.0,
                         [done](const CorrectionResult& result) { done->set_value(result); });
  while (answer.wait_for(kLookForTheEnd) != std::future_status::ready) {
    if (is_ending_ || ros::isShuttingDown()) throw std::runtime_error("the node ends");
  }
  const CorrectionResult result = answer.get();
  if (!result.success) throw std::runtime_error(result.message);
  response.message = result.message;
  response.moved = result.moved;
  response.fused = result.fused;
  response.seconds = result.seconds;
}

void MapServices::getDistances(const dtsdf_mapping::GetDistances::Request& request,
                               dtsdf_mapping::GetDistances::Response& response) {
  checkPoints(request.points);
  const Eigen::Isometry3d T_W_F =
      pipeline_.mapPoses().find(request.header.frame_id, request.header.stamp);
  const StampedSpace known = pipeline_.knownSpace();
  fillAnswer(*known.space, inMap(request.points, T_W_F), T_W_F, response);
  response.stamp = known.stamp;
}

}  // namespace dtsdf
