#include "ros/output/mesh_output.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/simplify.h"
#include "ros/common/callback_guard.h"

namespace dtsdf {

using Action = OutputSchedule::Action;
using Clock = std::chrono::steady_clock;

namespace {

/// No memory, most likely: to try again at once would not help.
constexpr std::chrono::milliseconds kAfterError{1000};

size_t bytesOf(const BlockMesh& block) {
  return sizeof(block) + block.vertices.size() * sizeof(block.vertices[0]) +
         block.triangles.size() * sizeof(block.triangles[0]);
}

}  // namespace

MeshOutput::MeshOutput(const Options& options, const Parts& parts)
    : colour_(options.colour),
      parts_(parts),
      max_queue_bytes_(options.max_queue_bytes),
      schedule_(options.mesh_rate_hz, options.points_rate_hz, Clock::now),
      mesh_(options.voxel_size_m) {}

std::chrono::milliseconds MeshOutput::step() noexcept {
  Action action = Action::kWait;
  const bool fine = guarded("output of the mesh", [&] {
    takeChanges();
    parts_.mesh_publisher.meetNewcomers();
    action = schedule_.next(situation());
    act(action);
    updateReport();
  });
  if (!fine) return kAfterError;
  return action == Action::kWait ? schedule_.idleTime(situation()) : std::chrono::milliseconds(0);
}

OutputSchedule::Situation MeshOutput::situation() const {
  return {parts_.mesh_publisher.hasChanges(), parts_.mesh_publisher.isBehind(share()),
          parts_.points_publisher.isDue()};
}

QueueShare MeshOutput::share() const {
  const size_t listeners = parts_.mesh_publisher.listeners() + parts_.points_publisher.listeners();
  return {max_queue_bytes_ / std::max<size_t>(listeners, 1)};
}

void MeshOutput::act(Action action) {
  if (action == Action::kWait) return;
  const Clock::time_point begin = Clock::now();
  switch (action) {
    case Action::kPublishMesh:
      parts_.mesh_publisher.publishChanges(mesh_, mesh_stamp_, share());
      break;
    case Action::kCatchUp:
      parts_.mesh_publisher.catchUp(mesh_, mesh_stamp_, share());
      break;
    case Action::kPublishPoints:
      parts_.points_publisher.publish(mesh_.assemble(), mesh_stamp_);
      break;
    case Action::kWait:
      break;
  }
  schedule_.done(action, begin);
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.publish_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void MeshOutput::takeChanges() {
  MeshChanges changes = parts_.mesh_changes.take();
  if (!changes.cleared && !changes.is_whole && changes.blocks.empty()) return;
  if (changes.cleared) {
    mesh_ = MeshStore(changes.voxel_size_m.value_or(mesh_.voxelSize()));
    mesh_bytes_ = 0;
    parts_.mesh_publisher.noteCleared();
  }
  if (changes.is_whole) changes.blocks = differences(mesh_, std::move(changes.blocks));
  for (const SharedBlockMesh& block : changes.blocks) {
    parts_.mesh_publisher.noteChange(block->key);
    put(block);
  }
  if (!changes.blocks.empty()) mesh_stamp_ = changes.stamp;
  parts_.points_publisher.noteChanges();
  updateReport();
}

void MeshOutput::updateReport() {
  std::vector<TopicReport> topics = parts_.mesh_publisher.report();
  topics.push_back(parts_.points_publisher.report());
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.triangles = mesh_.triangleCount();
  report_.mesh_bytes = mesh_bytes_;
  report_.topics = std::move(topics);
}

void MeshOutput::put(const SharedBlockMesh& block) {
  const auto before = mesh_.blocks().find(packedKeyOf(block->key));
  if (before != mesh_.blocks().end()) mesh_bytes_ -= bytesOf(*before->second);
  if (!block->triangles.empty()) mesh_bytes_ += bytesOf(*block);
  mesh_.put(block);
}

SavedMesh MeshOutput::save(const std::string& path, const SaveChoice& choice) {
  takeChanges();
  SimplifiedMesh saved;
  saved.mesh = choice.region ? mesh_.assemble(*choice.region) : mesh_.assemble();
  if (choice.region && saved.mesh.triangles.empty() && mesh_.triangleCount() > 0) {
    throw std::runtime_error("no triangle lies wholly in the region, in map frame coordinates; "
                             "nothing was saved");
  }
  if (choice.simplify_error_m != 0.0) {
    saved = simplifyMesh(saved.mesh, choice.simplify_error_m, choice.go_on);
  }
  saveMesh(saved.mesh, colour_, path);
  return {saved.mesh.vertices_m.size(), saved.mesh.triangles.size(), saved.error_m,
          lossInFormat(saved.mesh, path)};
}

OutputReport MeshOutput::report() const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  return report_;
}

}  // namespace dtsdf
