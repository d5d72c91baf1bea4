/// The loop of the output thread: applies mesh changes and lets the steps publish them.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <mutex>
#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/common/free_memory.h"
#include "ros/common/pace.h"
#include "ros/common/status_fields.h"
#include "ros/steps/mesh_queue.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Adds the output's meshes to the status.
inline void fillMeshes(const PagedMeshes::Stats& pages, size_t bytes, size_t max_bytes,
                       MapStatus& status) {
  addMemory(status, "mesh", kHost, bytes, max_bytes);
  addPages(status, pages, "blocks of the mesh");
  if (pages.failures > 0 && bytes > max_bytes) {
    report(status, MapStatus::WARN, MapStatus::DISK_FULL,
           "meshes cannot be moved to disk: " + pages.problem);
  }
}

/// Used on the output thread, unless stated otherwise. The map thread waits for the output only
/// when save_mesh brings the mesh up to date.
class Output {
 public:
  /// `params` and `steps` must outlive this object. @param wake Wakes the loop, so that it applies
  /// changes.
  Output(const NodeParams& params, const Steps& steps, std::function<void()> wake)
      : steps_(steps), queue_(std::move(wake)), mesh_(params.mapper.map) {}

  MeshQueue& queue() { return queue_; }
  ShownMesh& mesh() { return mesh_; }

  /// Publishes what is due. @return the time until the next call: a second after an error, which is
  /// most likely a lack of memory.
  std::chrono::milliseconds step() noexcept {
    SteadyDuration idle = std::chrono::seconds(1);
    guarded("output", [&] {
      const SteadyTime now = std::chrono::steady_clock::now();
      if (trim_pace_.isDue(now)) {
        trim_pace_.begin(now);
        returnFreeMemory();
      }
      // Polls, because new subscribers do not wake the loop.
      constexpr SteadyDuration kIdle = std::chrono::milliseconds(50);
      idle = std::clamp<SteadyDuration>(publish(), SteadyDuration::zero(), kIdle);
    });
    return toMilliseconds(idle);
  }

  /// On any thread: applies the changes in the queue.
  void takeChanges() {
    const std::lock_guard<std::mutex> lock(mesh_.mutex);
    takeChangesLocked();
  }

  /// Applies all changes. Older data are no longer published afterwards.
  void settle() {
    takeChanges();
    for (const auto& step : steps_) step->publish(nullptr);
  }

  /// May be called on any thread.
  void fill(MapStatus& status) const {
    const std::lock_guard<std::mutex> lock(report_mutex_);
    status.triangles = triangles_;
    status.publish_ms = static_cast<float>(publish_ms_);
    fillMeshes(pages_, bytes_, max_bytes_, status);
    if (triangles_ > 0 || status.frames_fused == 0) return;
    const bool is_wanted = std::any_of(steps_.begin(), steps_.end(),
                                       [](const auto& step) { return step->meshRate_hz(); });
    report(status, MapStatus::OK, is_wanted ? MapStatus::NO_SURFACE : MapStatus::NO_SUBSCRIBER,
           is_wanted ? "mapping; no triangles yet: no surface is supported by enough frames "
                       "(mesh/min_support)"
                     : "mapping; no mesh yet, because nobody subscribes to it");
  }

 private:
  void takeChangesLocked() {
    MeshChanges changes = queue_.take();
    if (!changes.cleared && !changes.is_whole && changes.blocks.empty()) return;
    PagedMeshes& meshes = mesh_.meshes;
    if (!changes.blocks.empty()) mesh_.stamp = changes.stamp;
    apply(changes, meshes);
    for (const auto& step : steps_) step->changed(changes);
    const std::lock_guard<std::mutex> lock(report_mutex_);
    triangles_ = meshes.triangleCount();
    bytes_ = meshes.bytes();
    max_bytes_ = meshes.maxBytes();
    pages_ = meshes.stats();
  }

  SteadyDuration publish() {
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

  const Steps& steps_;
  MeshQueue queue_;
  ShownMesh mesh_;
  Pace trim_pace_{1.0 / 30.0};

  mutable std::mutex report_mutex_;  ///< Guards the members below.
  size_t triangles_ = 0, bytes_ = 0, max_bytes_ = 0;
  PagedMeshes::Stats pages_;
  double publish_ms_ = 0.0;
};

}  // namespace dtsdf
