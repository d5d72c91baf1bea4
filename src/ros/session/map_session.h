/// The map at work: fuses the frames that come, extracts the mesh and hands over what changed.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "ros/common/schedule.h"
#include "ros/input/posed_frame.h"
#include "ros/output/map_report.h"
#include "ros/output/mesh_handover.h"

namespace dtsdf {

/// Map's thread only, but for report(). It waits for nobody: neither for transforms nor for
/// whoever shows or saves the mesh.
class MapSession {
 public:
  /// What the session works with; all of it outlives it.
  struct Parts {
    FrameQueue& frames;
    MeshHandover& mesh_changes;
    std::function<bool()> mesh_wanted;  ///< Whether anybody listens.
  };

  MapSession(std::unique_ptr<Mapper> mapper, double mesh_rate_hz, Parts parts,
             SteadyClock clock = std::chrono::steady_clock::now);

  void setMeshRate(double rate_hz) { schedule_.setMeshRate(rate_hz); }

  /// Does what is due. Returns how long there will be nothing to do. After a failure of the backend
  /// frames are dropped until clear() has made a new start.
  std::chrono::milliseconds step() noexcept;

  /// Hands over what the mesh lacks, also after a failure that has left the map usable.
  /// @throws std::runtime_error if it has not.
  void bringMeshUpToDate();

  /// Empties map and mesh, and starts over after a failure.
  /// @throws std::runtime_error if the backend cannot even do that.
  void clear();

  MapReport report() const;

 private:
  MapSchedule::Situation situation() const;
  std::chrono::milliseconds idleTime() const;
  void act(MapSchedule::Action action);
  void fuseNext();
  void takeFrame(const PosedFrame& frame);
  IntegrationResult fuse(const DepthFrame& frame);
  IntegrationResult paint(const ColourFrame& frame);
  void beginMesh();
  void finishMesh();
  void updateReport();
  bool hasFailed() const { return !report_.failure.empty(); }
  void fail(const std::string& text);

  std::unique_ptr<Mapper> mapper_;
  Parts parts_;
  MapSchedule schedule_;

  bool mesh_whole_ = true;  ///< False while an extraction is under way, and once one was lost.
  ros::Time map_stamp_;     ///< Of the newest frame in the map.
  ros::Time mesh_stamp_;    ///< The same when the last extraction was begun.

  mutable std::mutex report_mutex_;
  MapReport report_;  ///< Only this thread writes.
};

}  // namespace dtsdf
