#include "ros/output/mesh_output.h"

#include <algorithm>
#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {

using Action = OutputSchedule::Action;
using Clock = std::chrono::steady_clock;

namespace {

/// No memory, most likely: to try again at once would not help.
constexpr std::chrono::milliseconds kAfterError{1000};

}  // namespace

MeshOutput::MeshOutput(const ros::NodeHandle& nh, const MappingParams& params,
                       MeshHandover& mesh_changes)
    : colour_(params.mapper.mesh.colour),
      max_queue_bytes_(queueBytesOf(params.node.publish)),
      mesh_changes_(mesh_changes),
      mesh_(nh, {frameOfMap(params.node), colour_, params.node.publish.chunk_blocks}),
      points_(nh, frameOfMap(params.node), colour_),
      schedule_(params.node.publish.mesh_rate_hz, params.node.publish.points_rate_hz, Clock::now),
      meshes_(params.mapper.map) {}

std::chrono::milliseconds MeshOutput::step() noexcept {
  Action action = Action::kWait;
  const bool fine = guarded("output of the mesh", [&] {
    takeChanges();
    mesh_.meetNewcomers();
    action = schedule_.next(situation());
    act(action);
    updateReport();
  });
  if (!fine) return kAfterError;
  return action == Action::kWait ? schedule_.idleTime(situation()) : std::chrono::milliseconds(0);
}

OutputSchedule::Situation MeshOutput::situation() {
  return {mesh_.hasChanges(), mesh_.isBehind(share()), points_.isDue()};
}

QueueShare MeshOutput::share() const {
  const size_t listeners = mesh_.listeners() + points_.listeners();
  return {max_queue_bytes_ / std::max<size_t>(listeners, 1)};
}

void MeshOutput::act(Action action) {
  if (action == Action::kWait) return;
  const Clock::time_point begin = Clock::now();
  switch (action) {
    case Action::kPublishMesh: mesh_.publishChanges(meshes_, mesh_stamp_, share()); break;
    case Action::kCatchUp: mesh_.catchUp(meshes_, mesh_stamp_, share()); break;
    case Action::kPublishPoints:
      points_.publish(meshes_.all().assemble(), mesh_stamp_);
      meshes_.dropFetched();
      break;
    case Action::kWait: break;
  }
  schedule_.done(action, begin);
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.publish_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void MeshOutput::takeChanges() {
  MeshChanges changes = mesh_changes_.take();
  if (!changes.cleared && !changes.is_whole && changes.blocks.empty()) return;
  if (changes.cleared) {
    meshes_.clear(changes.voxel_size_m.value_or(meshes_.voxelSize()));
    mesh_.noteCleared();
  }
  if (changes.is_whole) {
    changes.blocks = differences(meshes_.all(), std::move(changes.blocks));
    meshes_.dropFetched();
  }
  for (const SharedBlockMesh& block : changes.blocks) {
    mesh_.noteChange(block->key);
    meshes_.put(block);
  }
  if (!changes.blocks.empty()) mesh_stamp_ = changes.stamp;
  points_.noteChanges();
  updateReport();
}

void MeshOutput::updateReport() {
  std::vector<TopicStatus> topics = mesh_.report();
  topics.push_back(points_.report());
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.triangles = meshes_.triangleCount();
  report_.mesh_bytes = meshes_.bytes();
  report_.max_mesh_bytes = meshes_.mostBytes();
  report_.paged_meshes = meshes_.stats();
  report_.topics = std::move(topics);
}

SavedMesh MeshOutput::save(const std::string& path, const SaveChoice& choice) {
  takeChanges();
  return savePagedMesh(meshes_, colour_, path, choice);
}

OutputReport MeshOutput::report() const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  return report_;
}

}  // namespace dtsdf
