#include "ros/steps/journal.h"

#include <ros/console.h>

#include <utility>

#include "io/map_chunks.h"
#include "ros/common/requests.h"
#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {
namespace {

/// Where a mapper runs does not change its map.
ParamTree settingsOf(const MapperParams& params) {
  ParamTree tree = toTree(params);
  tree.erase("backend");
  tree.erase("threads");
  return tree;
}

JournalWriter::Options optionsOf(const JournalParams& params) {
  return {expandHome(params.folder, "journal/folder"), static_cast<uint64_t>(params.max_gb * 1e9)};
}

/// A frame that the mapper refused for itself leaves the map as it was, at any pose.
bool isWritten(FrameStatus status) {
  return status == FrameStatus::kFused || status == FrameStatus::kNoMeasurement;
}

}  // namespace

JournalStep::JournalStep(const Host& host)
    : host_(host), params_(host.params.mapper), writer_(optionsOf(host.params.node.journal)) {
  begin(nullptr);
}

void JournalStep::begin(std::shared_ptr<const MapChunks> map) {
  const NodeParams& node = host_.params.node;
  writer_.begin({settingsOf(params_), node.poses, node.map_frame, frameOfMap(node)},
                std::move(map));
  level_.reset();
}

void JournalStep::replaced(const Replacement& replacement) {
  if (replacement.kind == Replacement::Kind::kCorrected) return;  // see corrected()
  if (replacement.head) params_ = withSettingsOf(*replacement.head, params_);
  begin(replacement.file);
}

void JournalStep::fused(const PosedFrame& frame, const IntegrationResult& result) {
  if (!isWritten(result.status)) return;
  const std::optional<Eigen::Isometry3d> level = host_.frame.level();
  if (level && (!level_ || level_->matrix() != level->matrix())) {
    writer_.add(journal::Level{*level});
    level_ = level;
  }
  const std::shared_ptr<const void> pixels(frame.pixels.get(), [keep = frame.pixels](auto*) {});
  writer_.add(journal::Image{frame.stamp.toSec(), static_cast<uint32_t>(frame.camera),
                             frame.given_T_W_C, frame.image, pixels});
  const JournalReport report = writer_.report();
  if (report.problem.empty()) return;
  ROS_WARN_STREAM_THROTTLE_NAMED(
      60.0, "dtsdf_mapping",
      "journal: " << report.problem << " (" << report.lost << " images and calls so far)");
}

void JournalStep::fill(dtsdf_mapping::MapStatus& status) {
  using dtsdf_mapping::MapStatus;
  const JournalReport journal = writer_.report();
  status.journal_bytes = journal.bytes;
  status.journal_waiting_bytes = journal.waiting_bytes;
  status.journal_lost = journal.lost;
  status.journal_first_stamp = toTime(journal.first_stamp_s.value_or(0.0));
  if (journal.problem.empty()) return;
  dtsdf::report(status, MapStatus::WARN, MapStatus::JOURNAL_INCOMPLETE,
                "journal: " + journal.problem);
}

}  // namespace dtsdf
