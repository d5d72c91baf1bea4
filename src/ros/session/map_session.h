/// The map at work: fuses the frames that come, keeps the mesh and feeds its publishers.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "params/node_params.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_intake.h"
#include "ros/output/map_report.h"
#include "ros/output/mesh_publisher.h"
#include "ros/output/surface_points_publisher.h"

namespace dtsdf {

/// Worker's thread only, but for report().
class MapSession {
 public:
  /// What the session works with; all of it outlives it.
  struct Parts {
    FrameIntake& intake;
    FrameAccounting& accounting;
    MeshPublisher& mesh_publisher;
    SurfacePointsPublisher& points_publisher;
  };

  /// @throws std::runtime_error if the backend asked for cannot be used.
  MapSession(const MappingParams& params, const Parts& parts);

  /// Fuses a frame and publishes what is due. Returns how long there will be nothing to do. A
  /// failing backend is reported, and the frames after it are dropped.
  std::chrono::milliseconds step() noexcept;

  /// Sends the whole mesh, brought up to date, to one subscriber.
  void publishAll(const ros::SingleSubscriberPublisher& newcomer);

  /// The whole mesh, brought up to date, also after a failure that has left the map usable.
  /// @throws std::runtime_error if it has not.
  Mesh currentMesh();

  void clear();

  MapReport report() const;

 private:
  using Clock = std::chrono::steady_clock;

  bool fuseNext();
  void fuse(const PosedFrame& frame);
  void updateMeshWhenDue(bool idle);
  void updateMesh();
  void finishMesh();
  void publishWhenDue();
  void updateReport();
  void fail(const std::string& text);

  MappingParams params_;
  Parts parts_;
  std::unique_ptr<Mapper> mapper_;
  MeshStore mesh_;
  std::vector<uint8_t> repacked_;  ///< Reused for images of foreign byte order.

  bool map_changed_ = false;    ///< Since the last extraction was begun.
  bool mesh_begun_ = false;
  bool mesh_whole_ = true;      ///< False once an extraction was lost.
  int frames_since_begin_ = 0;
  ros::Time mesh_stamp_;        ///< Of the newest frame in the map.
  bool report_outdated_ = false;
  Clock::time_point next_mesh_, next_publish_, next_points_, next_report_;

  mutable std::mutex report_mutex_;
  MapReport report_;
};

}  // namespace dtsdf
