/// The step that writes everything that changes the map to the journal.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "io/map_chunks.h"
#include "journal/writer.h"
#include "ros/common/requests.h"
#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Exists only if journal/folder is set. Waits for the disk only in the constructor and destructor.
class JournalStep : public Step {
 public:
  /// @throws std::runtime_error as JournalWriter does.
  explicit JournalStep(const Host& host)
      : host_(host),
        writer_({expandHome(host.params.journal_folder, "journal/folder"),
                 static_cast<uint64_t>(host.params.journal_max_gb * 1e9)}) {
    begin(nullptr);
  }

  void fused(const PosedFrame& frame, const IntegrationResult& result) override {
    // No surface is visible in a colour image rejected as kNoMeasurement, but one may be visible
    // from its corrected pose.
    if (result.status != FrameStatus::kFused && result.status != FrameStatus::kNoMeasurement) {
      return;
    }
    const std::optional<Eigen::Isometry3d> level = host_.frame.level();
    if (level && (!level_ || level_->matrix() != level->matrix())) {
      writer_.add(journal::Level{*level});
      level_ = level;
    }
    const std::shared_ptr<const void> pixels(frame.pixels.get(), [keep = frame.pixels](auto*) {});
    writer_.add(journal::Image{frame.stamp.toSec(), static_cast<uint32_t>(frame.camera),
                               frame.given_T_W_C, frame.image, pixels});
  }

  void regionCleared(const Region& region) override { writer_.add(region); }

  /// A loaded or emptied map begins a new journal; a corrected map does not.
  void replaced(const MapContents*, const std::shared_ptr<const MapChunks>& file) override {
    begin(file);
  }

  void fill(MapStatus& status) override {
    const JournalReport journal = writer_.report();
    status.journal_bytes = journal.bytes;
    status.journal_waiting_bytes = journal.waiting_bytes;
    if (journal.problem.empty()) return;
    report(status, MapStatus::WARN, MapStatus::JOURNAL_INCOMPLETE, "journal: " + journal.problem);
  }

  /// For CorrectStep, which reads and writes the journal.
  JournalWriter& writer() { return writer_; }

 private:
  void begin(std::shared_ptr<const MapChunks> map) {
    ParamTree settings = toTree(host_.map.settings());
    // The backend and the number of threads do not affect the map.
    for (const char* key : {"backend", "threads"}) settings.erase(key);
    const NodeParams& node = host_.params;
    writer_.begin({std::move(settings), node.poses, node.map_frame, frameOfMap(node)},
                  std::move(map));
    level_.reset();
  }

  const Host& host_;
  std::optional<Eigen::Isometry3d> level_;  ///< Levelling transform last written to the journal.
  JournalWriter writer_;
};

}  // namespace dtsdf
