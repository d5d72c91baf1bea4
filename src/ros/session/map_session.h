/// The map at work: fuses the frames that come, extracts the mesh and hands over what changed.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "ros/common/schedule.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_queue.h"
#include "ros/output/handovers.h"
#include "ros/output/reports.h"
#include "ros/output/view_publisher.h"
#include "ros/session/frame_poses.h"
#include "ros/session/levelling.h"
#include "ros/session/map_correction.h"
#include "ros/session/map_log.h"

namespace dtsdf {

/// Map's thread only, but for report() and throwIfFailed(). It waits for nobody: neither for
/// transforms nor for whoever shows or saves the mesh.
class MapSession {
 public:
  /// What the session works with; all of it outlives it.
  struct Parts {
    FrameQueue& frames;
    FrameLedger& ledger;
    MeshHandover& mesh_changes;
    std::function<bool()> mesh_wanted;  ///< Whether anybody listens.
    /// What map/keep_radius_m is round, at a frame's stamp; none, as without it: the camera.
    std::function<std::optional<Eigen::Vector3d>(const ros::Time&)> keep_center = nullptr;
    SpaceHandover* space = nullptr;       ///< Null: nobody asks for it.
    Levelling* levelling = nullptr;       ///< Null: poses are of the map's frame.
    FramePoses* poses = nullptr;          ///< Null: frames are fused where they are said to be.
    MapLog* log = nullptr;                ///< Null: nothing is logged.
    MapCorrection* correction = nullptr;  ///< Null, as without a log: poses stay as they are.
    ViewPublisher* views = nullptr;       ///< Null: nobody can ask for views of the map.
  };

  MapSession(std::unique_ptr<Mapper> mapper, double mesh_rate_hz, Parts parts,
             SteadyClock clock = std::chrono::steady_clock::now);

  void setMeshRate(double rate_hz) { schedule_.setMeshRate(rate_hz); }
  void setSpaceRate(double rate_hz) { schedule_.setSpaceRate(rate_hz); }

  /// Does what is due. Returns how long there will be nothing to do. After a failure of the backend
  /// frames are dropped until clear() has made a new start.
  std::chrono::milliseconds step() noexcept;

  /// What the mesh lacks was handed over, or a part of it.
  struct BroughtMesh {
    std::string problem;   ///< In what it is not that of the map; empty: in nothing.
    bool is_part = false;  ///< There is more.
  };
  /// Hands over what the mesh lacks, also after a failure that has left the map usable. Where it
  /// has not, the mesh stays what was handed over last, which is the problem then.
  BroughtMesh bringMeshUpToDate();

  /// Empties a part of the map.
  /// @throws std::runtime_error if the region has a problem, or the backend has failed, or fails.
  ClearedRegion clearRegion(const Region& region);

  /// Has the poses of frames corrected that were fused so far. @pre Its parts have a correction.
  /// @throws std::runtime_error after a failure of the backend.
  void correct(MapCorrection::Request request);

  /// A copy of the map. @throws std::exception if the backend cannot give it.
  MapContents contents();

  /// Whether some of the map is on disk: it is to be saved by save() then.
  bool isPaged() const { return mapper_->stats().pages.blocks > 0; }

  /// Saves the map piece by piece: frames wait. @throws std::exception as saveMapOf() does.
  SavedMap save(const std::string& path, const std::string& map_frame);

  /// Whether its map has a frame of its own, which is level.
  bool isLevelled() const { return parts_.levelling != nullptr && parts_.levelling->isOn(); }

  /// Whether nothing is mapped; no map that has failed counts as empty.
  bool isEmpty() const;

  /// A map from a file, in a mapper of its own.
  struct LoadedMap {
    std::unique_ptr<Mapper> mapper;
    float voxel_size_m;
    std::string path;
    std::shared_ptr<const MapContents> head;  ///< Of what is in the mapper.
    WriteMap write_map = nullptr;             ///< Writes that, for the log.
  };

  /// Goes on with a map that was loaded, and starts over after a failure; the whole mesh is handed
  /// over anew. @return the mapper so far.
  std::unique_ptr<Mapper> replace(LoadedMap loaded);

  /// Empties map and mesh, and starts over after a failure.
  /// @throws std::runtime_error if the backend cannot even do that.
  void clear();

  MapReport report() const;

  /// Any thread. @throws std::runtime_error after a failure of the backend; its text says so.
  void throwIfFailed() const;

 private:
  MapSchedule::Situation situation() const;
  std::chrono::milliseconds idleTime() const;
  void act(MapSchedule::Action action);
  void fuseNext();
  bool takeFrame(PosedFrame& frame);
  void showView(const PosedFrame& frame);
  std::optional<Rejection> findPose(PosedFrame& frame);
  FrameAccounting& accountingOf(const PosedFrame& frame) const;
  IntegrationResult integrate(const PosedFrame& frame);
  void log(const PosedFrame& frame, const IntegrationResult& result);
  MapOrigin origin(const std::string& map_frame = std::string()) const;
  void noteCleared(const Region& region);
  void beginMesh();
  void finishMesh();
  void handSpaceOver();
  void correctMap();
  void takePlace(MapCorrection::Corrected corrected);
  void handOverChangesOf(Space& replaced);
  std::string outdatedMesh() const;
  void forgetHandedOver(std::optional<float> voxel_size_m = std::nullopt);
  void updateReport();
  void forgetFailure();
  bool hasFailed() const { return !report_.failure.empty(); }
  void fail(const std::string& text);

  std::unique_ptr<Mapper> mapper_;
  Parts parts_;
  SteadyClock clock_;
  MapSchedule schedule_;

  RenderedView view_;
  bool mesh_is_part_ = false;    ///< The last extraction has left something to the next one.
  bool mesh_whole_ = true;       ///< False while an extraction is under way, and once one was lost.
  ros::Time map_stamp_;          ///< Of the newest frame in the map, but for those of a loaded one.
  double loaded_stamp_s_ = 0.0;  ///< Of those; 0: none.
  ros::Time mesh_stamp_;         ///< The same when the last extraction was begun.
  ros::Time surfaces_stamp_;     ///< That of the last one that was finished,
  ros::Time space_stamp_;        ///< and of the last one that was handed over to space as a whole.
  bool space_is_part_ = false;   ///< There is more to be handed over.

  mutable std::mutex report_mutex_;
  MapReport report_;  ///< Only this thread writes.
};

}  // namespace dtsdf
