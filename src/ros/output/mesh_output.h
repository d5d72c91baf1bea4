/// Everything that leaves: markers, surface points and files, written from the blocks' meshes that
/// the map hands over.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <mutex>
#include <string>

#include "io/saved_mesh.h"
#include "page/paged_meshes.h"
#include "params/node_params.h"
#include "ros/common/schedule.h"
#include "ros/output/handovers.h"
#include "ros/output/mesh_publisher.h"
#include "ros/output/reports.h"
#include "ros/output/surface_points_publisher.h"

namespace dtsdf {

/// Output's thread only, but for hasListeners() and report(). The map never waits for it.
class MeshOutput {
 public:
  /// `mesh_changes` outlives it.
  MeshOutput(const ros::NodeHandle& nh, const MappingParams& params, MeshHandover& mesh_changes);

  bool hasListeners() const { return mesh_.listeners() + points_.listeners() > 0; }

  void setRates(double mesh_rate_hz, double points_rate_hz) {
    schedule_.setRates(mesh_rate_hz, points_rate_hz);
  }

  /// Publishes what is due. Returns how long there will be nothing to do.
  std::chrono::milliseconds step() noexcept;

  /// Writes the mesh, with all that was handed over. @throws as savePagedMesh().
  SavedMesh save(const std::string& path, const SaveChoice& choice);

  /// After it, nothing is published that was handed over before the map was cleared last.
  void takeChanges();

  OutputReport report() const;

 private:
  OutputSchedule::Situation situation();
  void act(OutputSchedule::Action action);
  QueueShare share() const;
  void updateReport();

  const MeshColour colour_;
  const size_t max_queue_bytes_;
  MeshHandover& mesh_changes_;
  MeshPublisher mesh_;
  SurfacePointsPublisher points_;
  OutputSchedule schedule_;
  PagedMeshes meshes_;
  ros::Time mesh_stamp_;  ///< Of the newest frame in the mesh.

  mutable std::mutex report_mutex_;
  OutputReport report_;
};

}  // namespace dtsdf
