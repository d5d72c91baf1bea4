#include "ros/output/mesh_output.h"

#include "dtsdf_mapping/io/mesh_file.h"
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
      schedule_(options.mesh_rate_hz, options.points_rate_hz, Clock::now),
      mesh_(options.voxel_size_m) {}

std::chrono::milliseconds MeshOutput::step() noexcept {
  Action action = Action::kWait;
  const bool fine = guarded("output of the mesh", [&] {
    takeChanges();
    action = schedule_.next(situation());
    act(action);
  });
  if (!fine) return kAfterError;
  return action == Action::kWait ? schedule_.idleTime(situation()) : std::chrono::milliseconds(0);
}

OutputSchedule::Situation MeshOutput::situation() const {
  return {parts_.mesh_publisher.hasListeners() && parts_.mesh_publisher.hasChanges(),
          parts_.points_publisher.isDue()};
}

void MeshOutput::act(Action action) {
  if (action == Action::kWait) return;
  const Clock::time_point begin = Clock::now();
  if (action == Action::kPublishMesh) {
    parts_.mesh_publisher.publishChanges(mesh_);
  } else {
    parts_.points_publisher.publish(mesh_.assemble(), mesh_stamp_);
  }
  schedule_.done(action, begin);
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.publish_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void MeshOutput::takeChanges() {
  const MeshChanges changes = parts_.mesh_changes.take();
  if (!changes.cleared && changes.blocks.empty()) return;
  if (changes.cleared) {
    mesh_.clear();
    mesh_bytes_ = 0;
    parts_.mesh_publisher.noteCleared();
  }
  for (const SharedBlockMesh& block : changes.blocks) {
    parts_.mesh_publisher.noteChange(block->key);
    put(block);
  }
  if (!changes.blocks.empty()) mesh_stamp_ = changes.stamp;
  parts_.points_publisher.noteChanges();
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.triangles = mesh_.triangleCount();
  report_.mesh_bytes = mesh_bytes_;
}

void MeshOutput::put(const SharedBlockMesh& block) {
  const auto before = mesh_.blocks().find(packedKeyOf(block->key));
  if (before != mesh_.blocks().end()) mesh_bytes_ -= bytesOf(*before->second);
  if (!block->triangles.empty()) mesh_bytes_ += bytesOf(*block);
  mesh_.put(block);
}

void MeshOutput::publishAll(const ros::SingleSubscriberPublisher& newcomer) {
  takeChanges();
  parts_.mesh_publisher.publishAll(mesh_, newcomer);
}

SavedMesh MeshOutput::save(const std::string& path) {
  takeChanges();
  const Mesh mesh = mesh_.assemble();
  saveMesh(mesh, colour_, path);
  return {mesh.vertices_m.size(), mesh.triangles.size()};
}

OutputReport MeshOutput::report() const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  return report_;
}

}  // namespace dtsdf
