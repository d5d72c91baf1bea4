/// The step that writes what happens to the map into the frame log.
#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>

#include "log/log_queue.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// With log/folder. It waits for nobody, but for the copy of a map that a new stretch of the log
/// begins with.
class JournalStep : public Step {
 public:
  /// @throws std::runtime_error as FrameLog does.
  explicit JournalStep(const Host& host);

  void fused(const PosedFrame& frame, const IntegrationResult& result) override;
  void regionCleared(const Region& region) override { queue_.add(region); }
  void replaced(const Replacement& replacement) override;
  void fill(dtsdf_mapping::MapStatus& status) override;

  /// The map became that of corrected poses.
  void corrected(const LogCorrection& correction) { queue_.add(correction); }

  /// See LogQueue.
  std::future<std::optional<LogMark>> mark() { return queue_.mark(); }
  LogReport report() const { return queue_.report(); }

  const std::string& folder() const { return folder_; }
  /// Whether the map has frames that were logged.
  bool hasImages() const { return has_images_; }

 private:
  void begin(double stamp_s, WriteMap write_map, bool continues);
  WriteMap writerOfMap();
  WriteMap writeNow();
  void warnOfLoss() const;

  const Host& host_;
  const std::string folder_;
  MapperParams params_;  ///< Of the map as it is.
  std::optional<Eigen::Isometry3d> logged_level_;
  bool has_images_ = false;
  uint64_t waiting_maps_ = 0;  ///< So far.
  LogQueue queue_;
};

}  // namespace dtsdf
