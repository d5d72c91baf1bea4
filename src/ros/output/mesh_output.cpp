#include "ros/output/mesh_output.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/simplify.h"
#include "io/ply_stream.h"
#include "kernels/core/grid.h"
#include "map/region_view.h"
#include "ros/common/callback_guard.h"

namespace dtsdf {

using Action = OutputSchedule::Action;
using Clock = std::chrono::steady_clock;

namespace {

/// No memory, most likely: to try again at once would not help.
constexpr std::chrono::milliseconds kAfterError{1000};

/// Blocks that the mesh of a region may come from.
std::vector<PackedKey> blocksIn(const BoxRegion& region, const PagedMeshes& meshes) {
  const RegionView in_voxels = makeRegionView(region, meshes.voxelSize());
  std::vector<PackedKey> keys = meshes.keys();
  const auto is_outside = [&](PackedKey key) {
    return !mayHaveVerticesIn(in_voxels, unpackKey(key));
  };
  keys.erase(std::remove_if(keys.begin(), keys.end(), is_outside), keys.end());
  return keys;
}

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

/// Nothing is saved where some of it cannot be read now; without what is damaged it is.
SavedMesh MeshOutput::save(const std::string& path, const SaveChoice& choice) {
  takeChanges();
  const uint64_t failures = meshes_.stats().failures;
  const auto check = [&] {
    const PagedMeshes::Stats stats = meshes_.stats();
    if (stats.failures == failures) return;
    meshes_.dropFetched();
    throw std::runtime_error("nothing was saved: " + stats.problem);
  };
  const bool is_plain = !choice.region && choice.simplify_error_m == 0.0;
  if (meshes_.isPaged() && is_plain && meshFormatOf(path) == MeshFormat::kPly) {
    return saveInPieces(path, check);
  }
  const MeshStore& mesh =
      meshes_.holding(choice.region ? blocksIn(*choice.region, meshes_) : meshes_.keys());
  check();
  SimplifiedMesh saved;
  saved.mesh = choice.region ? mesh.assemble(*choice.region) : mesh.assemble();
  meshes_.dropFetched();
  if (choice.region && saved.mesh.triangles.empty() && meshes_.triangleCount() > 0) {
    throw std::runtime_error(
        "no triangle lies wholly in the region, in map frame coordinates; "
        "nothing was saved");
  }
  if (choice.simplify_error_m != 0.0) {
    saved = simplifyMesh(saved.mesh, choice.simplify_error_m, choice.go_on);
  }
  saveMesh(saved.mesh, colour_, path);
  return {saved.mesh.vertices_m.size(), saved.mesh.triangles.size(), saved.error_m,
          lossInFormat(saved.mesh, path)};
}

/// The same file, block by block.
/// @param check Called before it gets its name.
SavedMesh MeshOutput::saveInPieces(const std::string& path, const std::function<void()>& check) {
  PlyStream file(path, colour_);
  meshes_.stream({[&](const Mesh& piece) { file.addVertices(piece); },
                  [&](const std::array<uint32_t, 3>& corners) { file.addTriangle(corners); }});
  check();
  file.finish();
  return {static_cast<size_t>(file.vertices()), static_cast<size_t>(file.triangles()), 0.0, ""};
}

OutputReport MeshOutput::report() const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  return report_;
}

}  // namespace dtsdf
