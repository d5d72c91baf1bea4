#include "ros/node/output.h"

#include <algorithm>
#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/common/free_memory.h"
#include "ros/common/status_fields.h"

namespace dtsdf {
namespace {

/// Nobody wakes the thread for a new listener.
constexpr std::chrono::milliseconds kOutputIdle{50};
/// No memory, most likely: to try again at once would not help.
constexpr std::chrono::milliseconds kAfterError{1000};
constexpr double kTrimRate_hz = 1.0 / 30.0;

}  // namespace

Output::Output(const MappingParams& params, const Steps& steps, std::function<void()> wake)
    : steps_(steps), queue_(std::move(wake)), mesh_(params.mapper.map), trim_pace_(kTrimRate_hz) {}

std::chrono::milliseconds Output::step() noexcept {
  SteadyDuration idle = kAfterError;
  guarded("output", [&] {
    const SteadyTime now = std::chrono::steady_clock::now();
    if (trim_pace_.isDue(now)) {
      trim_pace_.begin(now);
      returnFreeMemory();
    }
    idle = std::clamp<SteadyDuration>(publish(), SteadyDuration::zero(), kOutputIdle);
  });
  return toMilliseconds(idle);
}

SteadyDuration Output::publish() {
  const SteadyTime begin = std::chrono::steady_clock::now();
  const std::unique_lock<std::mutex> lock(mesh_.mutex, std::try_to_lock);
  if (lock.owns_lock()) takeChangesLocked();
  SteadyDuration idle = SteadyDuration::max();
  for (const auto& step : steps_) {
    idle = std::min(idle, step->publish(lock.owns_lock() ? &mesh_ : nullptr));
  }
  const double took_ms = 1000.0 * toSeconds(std::chrono::steady_clock::now() - begin);
  const std::lock_guard<std::mutex> report_lock(report_mutex_);
  if (took_ms > 1.0) publish_ms_ = took_ms;  // else nothing was published
  return idle;
}

void Output::takeChanges() {
  const std::lock_guard<std::mutex> lock(mesh_.mutex);
  takeChangesLocked();
}

void Output::takeChangesLocked() {
  MeshChanges changes = queue_.take();
  if (!changes.cleared && !changes.is_whole && changes.blocks.empty()) return;
  PagedMeshes& meshes = mesh_.meshes;
  if (changes.cleared) meshes.clear(changes.voxel_size_m.value_or(meshes.voxelSize()));
  if (changes.is_whole) {
    changes.blocks = differences(meshes.all(), std::move(changes.blocks));
    meshes.dropFetched();
  }
  for (const SharedBlockMesh& block : changes.blocks) meshes.put(block);
  if (!changes.blocks.empty()) mesh_.stamp = changes.stamp;
  for (const auto& step : steps_) step->changed(changes);
  const std::lock_guard<std::mutex> lock(report_mutex_);
  triangles_ = meshes.triangleCount();
  bytes_ = meshes.bytes();
  max_bytes_ = meshes.mostBytes();
  pages_ = meshes.stats();
}

void Output::settle() {
  takeChanges();
  for (const auto& step : steps_) step->publish(nullptr);
}

void Output::fill(MapStatus& status) const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  status.triangles = triangles_;
  status.publish_ms = static_cast<float>(publish_ms_);
  fillMeshes(pages_, bytes_, max_bytes_, status);
  if (triangles_ > 0 || status.frames_fused == 0) return;
  const bool is_wanted = std::any_of(steps_.begin(), steps_.end(),
                                     [](const auto& step) { return step->meshRate_hz(); });
  if (is_wanted) {
    report(status, MapStatus::OK, MapStatus::NO_SURFACE,
           "mapping; no triangles yet: no surface has been seen by enough frames "
           "(mesh/min_support)");
  } else {
    report(status, MapStatus::OK, MapStatus::NO_SUBSCRIBER,
           "mapping; no mesh yet, because nobody subscribes to it");
  }
}

void fillMeshes(const PagedMeshes::Stats& pages, size_t bytes, size_t max_bytes,
                MapStatus& status) {
  addMemory(status, "mesh", kHost, bytes, max_bytes);
  addPages(status, pages);
  if (pages.lost > 0) {
    report(status, MapStatus::WARN, MapStatus::MESHES_LOST,
           "the meshes of " + std::to_string(pages.lost) +
               " blocks could not be read back and are not shown: " + pages.problem);
  }
  if (pages.failures > 0 && bytes > max_bytes) {
    report(status, MapStatus::WARN, MapStatus::MESHES_IN_MEMORY,
           "meshes stay in memory: " + pages.problem);
  }
}

}  // namespace dtsdf
