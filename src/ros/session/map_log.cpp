#include "ros/session/map_log.h"

#include <ros/console.h>

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <variant>

#include "log/log_folder.h"
#include "params/printable.h"

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

MapLog::MapLog(const MappingParams& params, const std::string& folder, const Levelling& levelling)
    : folder_(folder),
      params_(params.mapper),
      map_frame_(params.node.map_frame),
      poses_(params.node.poses),
      levelling_(levelling),
      queue_(queueOptions(params.node.log, folder)) {
  for (const std::string& left : waitingMapsIn(folder))
    static_cast<void>(std::remove(left.c_str()));
  emptied();
}

void MapLog::begin(double stamp_s, WriteMap write_map, bool continues) {
  LogBegin begin;
  begin.settings = settingsOf(params_);
  begin.poses = poses_;
  begin.map_frame = map_frame_;
  begin.continues = begin.stands_for_lost = continues;
  begin.stamp_s = stamp_s;
  queue_.begin(std::move(begin), std::move(write_map));
  logged_level_.reset();
  has_images_ = has_images_ && continues;
}

void MapLog::loaded(const MapContents& head, WriteMap write_map) {
  params_ = withSettingsOf(head, params_);
  begin(head.stamp_s, std::move(write_map), false);
}

bool MapLog::taken(const PosedFrame& frame, const IntegrationResult& result) {
  if (!isLogged(result.status)) return false;
  has_images_ = true;
  const std::optional<Eigen::Isometry3d> level = levelling_.level();
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
  return queue_.wantsMap();
}

void MapLog::checkpoint(Mapper& mapper, const MapOrigin& origin) {
  WriteMap write_map =
      mapper.stats().pages.blocks > 0
          ? writeNow(mapper, origin)
          : writerOf(std::make_shared<const MapContents>(contentsWith(origin, mapper)));
  checkpoint(origin.stamp_s, std::move(write_map));
}

/// What fails with the disk fails in the log, as if it were written later.
WriteMap MapLog::writeNow(Mapper& mapper, const MapOrigin& origin) {
  const auto waiting = std::make_shared<const WaitingMap>(waitingMapName(folder_, ++waiting_maps_));
  try {
    saveMapOf(mapper, origin, waiting->path());
  } catch (const std::runtime_error& error) {
    return [text = errorText(error)](const std::string&) { throw std::runtime_error(text); };
  }
  return [waiting](const std::string& path) { waiting->moveTo(path); };
}

void MapLog::warnOfLoss() const {
  const LogReport report = queue_.report();
  if (report.problem.empty()) return;
  ROS_WARN_STREAM_THROTTLE_NAMED(
      60.0, "dtsdf_mapping",
      "frame log: " << report.problem << " (" << report.lost << " images and calls lost so far)");
}

}  // namespace dtsdf
