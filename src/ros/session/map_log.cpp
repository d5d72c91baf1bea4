#include "ros/session/map_log.h"

#include <ros/console.h>

#include <utility>
#include <variant>

namespace dtsdf {
namespace {

/// Where a mapper runs does not change its map.
ParamTree settingsOf(MapperParams params) {
  ParamWriter writer;
  visitParams(params, writer);
  writer.tree.erase("backend");
  writer.tree.erase("threads");
  return std::move(writer.tree);
}

LogQueue::Options queueOptions(const LogParams& params, const std::string& folder) {
  LogQueue::Options options;
  options.log.folder = folder;
  options.log.max_bytes = static_cast<uint64_t>(params.max_gb * 1e9);
  return options;
}

/// A frame that the mapper refused for itself leaves the map as it was, at any pose.
bool isLogged(FrameStatus status) {
  return status == FrameStatus::kFused || status == FrameStatus::kNoMeasurement;
}

}  // namespace

MapLog::MapLog(const MappingParams& params, const std::string& folder, const Levelling& levelling)
    : folder_(folder),
      params_(params.mapper),
      map_frame_(params.node.map_frame),
      levelling_(levelling),
      queue_(queueOptions(params.node.log, folder)) {
  emptied();
}

void MapLog::begin(std::shared_ptr<const MapContents> contents, bool continues) {
  LogBegin begin;
  begin.settings = settingsOf(params_);
  begin.map_frame = map_frame_;
  begin.continues = begin.stands_for_lost = continues;
  if (contents != nullptr) begin.stamp_s = contents->stamp_s;
  queue_.begin(std::move(begin), std::move(contents));
  logged_level_.reset();
  has_images_ = has_images_ && continues;
}

void MapLog::loaded(std::shared_ptr<const MapContents> contents) {
  params_ = withSettingsOf(*contents, params_);
  begin(std::move(contents), false);
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

void MapLog::checkpoint(MapContents contents) {
  begin(std::make_shared<const MapContents>(std::move(contents)), true);
}

void MapLog::warnOfLoss() const {
  const LogReport report = queue_.report();
  if (report.problem.empty()) return;
  ROS_WARN_STREAM_THROTTLE_NAMED(
      60.0, "dtsdf_mapping",
      "frame log: " << report.problem << " (" << report.lost << " images and calls lost so far)");
}

}  // namespace dtsdf
