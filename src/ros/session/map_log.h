/// What happens to the node's map, for the frame log.
#pragma once

#include <future>
#include <optional>
#include <string>
#include <utility>

#include "dtsdf_mapping/mapper.h"
#include "io/map_chunks.h"
#include "log/log_queue.h"
#include "params/node_params.h"
#include "ros/input/frame_queue.h"
#include "ros/session/levelling.h"

namespace dtsdf {

/// Map's thread only, but for report(). It waits for nobody, but for the copy of a map that a new
/// stretch of the log begins with.
class MapLog {
 public:
  /// `levelling` outlives it. @throws std::runtime_error as FrameLog does.
  MapLog(const MappingParams& params, const std::string& folder, const Levelling& levelling);

  /// The map was emptied, and keeps its settings.
  void emptied() { begin(0.0, nullptr, false); }

  /// The map became another one, with settings of its own.
  void loaded(const MapContents& head, WriteMap write_map);

  /// A frame was handed to the mapper, with this result. @return whether the log needs the map, for
  /// a new stretch.
  bool taken(const PosedFrame& frame, const IntegrationResult& result);

  /// A part of the map was emptied.
  void cleared(const Region& region) { queue_.add(region); }

  /// The map as it is, for a new stretch: a copy that is written beside the frames to come, or, of
  /// a map that is on disk in part, a file that is written now, piece by piece.
  void checkpoint(Mapper& mapper, const MapOrigin& origin);
  /// The same of a map with frames up to this stamp.
  void checkpoint(double stamp_s, WriteMap write_map) {
    begin(stamp_s, std::move(write_map), true);
  }

  /// The map became that of corrected poses.
  void corrected(const LogCorrection& correction) { queue_.add(correction); }

  /// See LogQueue.
  std::future<std::optional<LogMark>> mark() { return queue_.mark(); }

  const std::string& folder() const { return folder_; }

  /// Whether the map has frames that were logged.
  bool hasImages() const { return has_images_; }

  LogReport report() const { return queue_.report(); }

 private:
  void begin(double stamp_s, WriteMap write_map, bool continues);
  WriteMap writeNow(Mapper& mapper, const MapOrigin& origin);
  void warnOfLoss() const;

  const std::string folder_;
  MapperParams params_;  ///< Of the map as it is.
  const std::string map_frame_;
  const PoseParams poses_;
  const Levelling& levelling_;
  std::optional<Eigen::Isometry3d> logged_level_;
  bool has_images_ = false;
  uint64_t waiting_maps_ = 0;  ///< So far.
  LogQueue queue_;
};

}  // namespace dtsdf
