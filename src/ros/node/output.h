/// The output's loop: takes over what changed in the mesh, and has the steps publish it.
#pragma once

#include <dtsdf_mapping/MapStatus.h>

#include <chrono>
#include <functional>
#include <mutex>

#include "ros/common/pace.h"
#include "ros/steps/mesh_queue.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Output's thread, except where something else is said. The map never waits for it.
class Output {
 public:
  /// `params` and `steps` outlive it. @param wake Has the loop look for changes.
  Output(const MappingParams& params, const Steps& steps, std::function<void()> wake);

  MeshQueue& queue() { return queue_; }
  ShownMesh& mesh() { return mesh_; }

  /// Publishes what is due. Returns how long there will be nothing to do.
  std::chrono::milliseconds step() noexcept;

  /// Any thread: takes over what was handed over.
  void takeChanges();
  /// Once it has returned, nothing is published that was handed over before.
  void settle();

  /// Any thread.
  void fill(dtsdf_mapping::MapStatus& status) const;

 private:
  void takeChangesLocked();
  SteadyDuration publish();

  const Steps& steps_;
  MeshQueue queue_;
  ShownMesh mesh_;
  Pace trim_pace_;

  mutable std::mutex report_mutex_;  ///< Guards what follows.
  size_t triangles_ = 0, bytes_ = 0, max_bytes_ = 0;
  PagedMeshes::Stats pages_;
  double publish_ms_ = 0.0;
};

/// Writes what the status says of the meshes that are kept.
void fillMeshes(const PagedMeshes::Stats& pages, size_t bytes, size_t max_bytes,
                dtsdf_mapping::MapStatus& status);

}  // namespace dtsdf
