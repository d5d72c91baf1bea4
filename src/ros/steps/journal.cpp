#include "ros/steps/journal.h"

#include <ros/console.h>

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <variant>

#include "io/map_chunks.h"
#include "log/log_folder.h"
#include "params/printable.h"
#include "ros/common/requests.h"
#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"
#include "ros/steps/live_map.h"
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

LogQueue::Options queueOptions(const LogParams& params, const std::string& folder) {
  LogQueue::Options options;
  options.log.folder = folder;
  options.log.max_bytes = static_cast<uint64_t>(params.max_gb * 1e9);
  return options;
}

/// A map file that goes where it did not become that of a stretch.
class WaitingMap {
 public:
  explicit WaitingMap(std::string path) : path_(std::move(path)) {}
  ~WaitingMap() { static_cast<void>(std::remove(path_.c_str())); }
  WaitingMap(const WaitingMap&) = delete;
  WaitingMap& operator=(const WaitingMap&) = delete;

  const std::string& path() const { return path_; }
  void moveTo(const std::string& path) const {
    if (std::rename(path_.c_str(), path.c_str()) == 0) return;
    throw std::runtime_error("cannot write '" + printable(path) +
                             "': " + std::generic_category().message(errno));
  }

 private:
  const std::string path_;
};

/// A frame that the mapper refused for itself leaves the map as it was, at any pose.
bool isLogged(FrameStatus status) {
  return status == FrameStatus::kFused || status == FrameStatus::kNoMeasurement;
}

}  // namespace

JournalStep::JournalStep(const Host& host)
    : host_(host),
      folder_(expandHome(host.params.node.log.folder, "log/folder")),
      params_(host.params.mapper),
      queue_(queueOptions(host.params.node.log, folder_)) {
  for (const std::string& left : waitingMapsIn(folder_)) {
    static_cast<void>(std::remove(left.c_str()));
  }
  begin(0.0, nullptr, false);
}

void JournalStep::begin(double stamp_s, WriteMap write_map, bool continues) {
  LogBegin begin;
  begin.settings = settingsOf(params_);
  begin.poses = host_.params.node.poses;
  begin.map_frame = host_.params.node.map_frame;
  begin.continues = begin.stands_for_lost = continues;
  begin.stamp_s = stamp_s;
  queue_.begin(std::move(begin), std::move(write_map));
  logged_level_.reset();
  has_images_ = has_images_ && continues;
}

void JournalStep::replaced(const Replacement& replacement) {
  if (replacement.kind == Replacement::Kind::kCleared) return begin(0.0, nullptr, false);
  if (replacement.kind == Replacement::Kind::kCorrected) return;  // see corrected()
  params_ = withSettingsOf(*replacement.head, params_);
  begin(replacement.head->stamp_s, replacement.write, false);
}

void JournalStep::fused(const PosedFrame& frame, const IntegrationResult& result) {
  if (!isLogged(result.status)) return;
  has_images_ = true;
  const std::optional<Eigen::Isometry3d> level = host_.frame.level();
  if (level && (!logged_level_ || logged_level_->matrix() != level->matrix())) {
    queue_.addLevel(*level);
    logged_level_ = level;
  }
  const std::shared_ptr<const void> pixels(frame.pixels.get(),
                                           [keep = frame.pixels](const void*) {});
  std::visit(
      [&](const auto& image) {
        queue_.add(image, frame.stamp.toSec(), static_cast<uint32_t>(frame.camera), pixels);
      },
      frame.image);
  warnOfLoss();
  // A map that is copied is that of the frames logged so far.
  if (queue_.wantsMap()) begin(host_.map.origin().stamp_s, writerOfMap(), true);
}

/// The map as it is, for a new stretch: a copy that is written beside the frames to come, or, of a
/// map that is on disk in part, a file that is written now, piece by piece.
WriteMap JournalStep::writerOfMap() {
  if (host_.map.isPaged()) return writeNow();
  return writerOf(
      std::make_shared<const MapContents>(contentsWith(host_.map.origin(), host_.map.mapper())));
}

/// What fails with the disk fails in the log, as if it were written later.
WriteMap JournalStep::writeNow() {
  const auto waiting = std::make_shared<const WaitingMap>(waitingMapName(folder_, ++waiting_maps_));
  try {
    saveMapOf(host_.map.mapper(), host_.map.origin(), waiting->path());
  } catch (const std::runtime_error& error) {
    return [text = errorText(error)](const std::string&) { throw std::runtime_error(text); };
  }
  return [waiting](const std::string& path) { waiting->moveTo(path); };
}

void JournalStep::warnOfLoss() const {
  const LogReport report = queue_.report();
  if (report.problem.empty()) return;
  ROS_WARN_STREAM_THROTTLE_NAMED(
      60.0, "dtsdf_mapping",
      "frame log: " << report.problem << " (" << report.lost << " images and calls lost so far)");
}

void JournalStep::fill(MapStatus& status) {
  const LogReport log = queue_.report();
  status.log_bytes = log.bytes;
  status.log_waiting_bytes = log.waiting_bytes;
  status.log_lost = log.lost;
  status.log_first_stamp = toTime(log.first_stamp_s.value_or(0.0));
  if (log.problem.empty()) return;
  dtsdf::report(status, MapStatus::WARN, MapStatus::LOG_INCOMPLETE, "frame log: " + log.problem);
}

}  // namespace dtsdf
