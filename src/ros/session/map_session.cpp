#include "ros/session/map_session.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/partly_cleared.h"
#include "params/printable.h"

namespace dtsdf {

using Action = MapSchedule::Action;

namespace {

/// While space is handed over in parts.
constexpr std::chrono::milliseconds kToNextPart{20};

SpaceChanges allChangesOf(Space& space) {
  SpaceChanges all = space.takeChanges();
  while (all.is_part) {
    const SpaceChanges more = space.takeChanges();
    all.cubes.insert(all.cubes.end(), more.cubes.begin(), more.cubes.end());
    all.is_part = more.is_part;
  }
  return all;
}

}  // namespace

MapSession::MapSession(std::unique_ptr<Mapper> mapper, double mesh_rate_hz, Parts parts,
                       SteadyClock clock)
    : mapper_(std::move(mapper)),
      parts_(std::move(parts)),
      clock_(clock),
      schedule_(mesh_rate_hz, std::move(clock)) {
  report_.backend = mapper_->backendName();
  report_.stats = mapper_->stats();  // the budget is known before the first frame
}

std::chrono::milliseconds MapSession::step() noexcept {
  try {
    const Action action = schedule_.next(situation());
    if (action == Action::kWait && space_is_part_ && !hasFailed()) {
      handSpaceOver();
      return std::min(idleTime(), kToNextPart);
    }
    if (action == Action::kWait) return idleTime();
    act(action);
  } catch (const std::exception& error) {
    fail(errorText(error));
  } catch (...) {
    fail("unknown error");
  }
  return std::chrono::milliseconds(0);
}

std::chrono::milliseconds MapSession::idleTime() const {
  const std::chrono::milliseconds idle = schedule_.idleTime(situation());
  const SteadyDuration to_turn = parts_.frames.idleTime();
  return to_turn < idle ? toMilliseconds(to_turn) : idle;
}

MapSchedule::Situation MapSession::situation() const {
  MapSchedule::Situation situation;
  situation.frame_ready = parts_.frames.hasTurn();
  if (hasFailed()) return situation;
  situation.mesh_wanted = parts_.mesh_wanted();
  situation.mesh_made = mapper_->isMeshMade();
  situation.correcting = parts_.correction != nullptr && parts_.correction->hasWork();
  situation.correction_first = situation.correcting && parts_.correction->goesFirst();
  situation.space_followed = parts_.space != nullptr && mapper_->space() != nullptr;
  return situation;
}

void MapSession::act(Action action) {
  switch (action) {
    case Action::kFuse: return fuseNext();
    case Action::kBeginMesh: return beginMesh();
    case Action::kFinishMesh: return finishMesh();
    case Action::kReport: return updateReport();
    case Action::kCorrect: return correctMap();
    case Action::kWait: return;
  }
}

void MapSession::fuseNext() {
  std::optional<PosedFrame> frame = parts_.frames.take();
  if (!frame) return;  // was pushed out meanwhile
  if (hasFailed()) {
    accountingOf(*frame).dropped(DropReason::kBackendError, frame->stamp, report_.failure);
    return;
  }
  bool is_fused = false;
  try {
    is_fused = takeFrame(*frame);
  } catch (const std::exception& error) {
    accountingOf(*frame).dropped(DropReason::kBackendError, frame->stamp, errorText(error));
    throw;
  }
  if (is_fused) showView(*frame);
}

/// The map as the frame's camera would see it.
void MapSession::showView(const PosedFrame& frame) {
  const auto* depth = std::get_if<DepthFrame>(&frame.image);
  if (depth == nullptr || parts_.views == nullptr || !parts_.views->isDue()) return;
  const SteadyTime begin = clock_();
  const RenderCamera camera{depth->width, depth->height, depth->intrinsics};
  try {
    mapper_->render(camera, depth->T_W_C, view_);
  } catch (const std::exception& error) {  // of a GPU that is lost the next frame says so
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "no image on rendered/image: " << errorText(error));
    return;
  }
  std_msgs::Header header;
  header.stamp = frame.stamp;
  header.frame_id = frame.frame_id;
  parts_.views->publish(header, camera, view_, begin);
}

FrameAccounting& MapSession::accountingOf(const PosedFrame& frame) const {
  return parts_.ledger.of(frame.stream);
}

IntegrationResult MapSession::integrate(const PosedFrame& frame) {
  const auto* depth = std::get_if<DepthFrame>(&frame.image);
  IntegrationResult result = depth != nullptr ? mapper_->integrate(*depth)
                                              : mapper_->paint(std::get<ColourFrame>(frame.image));
  const std::lock_guard<std::mutex> lock(report_mutex_);
  if (result.status == FrameStatus::kFused) {
    (depth != nullptr ? report_.integrate_ms : report_.paint_ms) = result.duration_ms;
  }
  return result;
}

/// Of a frame that is to be fused or painted; else why it is not.
std::optional<Rejection> MapSession::findPose(PosedFrame& frame) {
  if (parts_.poses != nullptr) {
    if (auto rejection = parts_.poses->expect(frame)) return rejection;
  }
  if (parts_.levelling != nullptr && !parts_.levelling->bring(frame)) {
    return Rejection{DropReason::kNotLevel,
                     "the map is not level yet: " + parts_.levelling->problem()};
  }
  return parts_.poses != nullptr ? parts_.poses->place(*mapper_, frame) : std::nullopt;
}

/// @return whether it is in the map.
bool MapSession::takeFrame(PosedFrame& frame) {
  if (const auto rejection = findPose(frame)) {
    accountingOf(frame).dropped(rejection->reason, frame.stamp, rejection->text);
    return false;
  }
  auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth != nullptr && parts_.keep_center) {
    depth->keep_center_W = parts_.keep_center(frame.stamp);
  }
  if (parts_.correction != nullptr) parts_.correction->place(frame);
  const IntegrationResult result = integrate(frame);
  if (result.status != FrameStatus::kFused) {
    log(frame, result);
    accountingOf(frame).dropped(dropReasonOf(result.status), frame.stamp, result.message);
    return false;
  }
  accountingOf(frame).fused(frame.stamp);
  if (parts_.correction != nullptr) parts_.correction->wasFused(frame);
  if (parts_.poses != nullptr) parts_.poses->wasFused(frame);
  // Colour may come late; depth that goes back has begun anew.
  map_stamp_ = depth != nullptr ? frame.stamp : std::max(map_stamp_, frame.stamp);
  log(frame, result);
  schedule_.frameFused();
  if (result.refused_blocks > 0) {
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "the map is full: " << result.refused_blocks
                                                       << " blocks of the last frame were refused; "
                                                          "raise map/max_memory_mb, or clear_map");
  }
  return true;
}

/// A map that is copied is that of the frames logged so far.
void MapSession::log(const PosedFrame& frame, const IntegrationResult& result) {
  if (parts_.log == nullptr || !parts_.log->taken(frame, result)) return;
  parts_.log->checkpoint(*mapper_, origin());
}

void MapSession::beginMesh() {
  mesh_whole_ = false;  // should the next line fail
  mapper_->beginMeshUpdate();
  mesh_stamp_ = map_stamp_;
  schedule_.meshBegun();
}

void MapSession::finishMesh() {
  schedule_.meshEnded();
  MeshUpdate update = mapper_->finishMeshUpdate();
  schedule_.meshTook(toSteadyDuration(update.duration_ms / 1000.0));
  mesh_is_part_ = update.is_part;
  if (mesh_is_part_) schedule_.meshWasPart();
  {
    const std::lock_guard<std::mutex> lock(report_mutex_);
    report_.mesh_ms = update.duration_ms;
  }
  parts_.mesh_changes.add(std::move(update), mesh_stamp_);
  mesh_whole_ = true;
  surfaces_stamp_ = mesh_stamp_;
  handSpaceOver();
}

/// As an extraction may be finished after one more frame, cells may be free by a later frame than
/// surfaces are of; the stamp promises only what has surfaces too. Of much, a part, and more once
/// that was taken.
void MapSession::handSpaceOver() {
  Space* const space = mapper_->space();
  if (parts_.space == nullptr || space == nullptr) return;
  space_is_part_ = true;
  if (parts_.space->isFull()) return;
  const SpaceChanges changes = space->takeChanges();
  space_is_part_ = changes.is_part;
  if (!space_is_part_) space_stamp_ = surfaces_stamp_;
  parts_.space->add(changes, space->cellSize_m(), space_stamp_);
}

std::string MapSession::outdatedMesh() const {
  return "; the backend has failed, so this is the last extracted mesh: " + report_.failure;
}

MapSession::BroughtMesh MapSession::bringMeshUpToDate() {
  // Changes were lost, so later ones would not fit what was handed over.
  if (!mesh_whole_ && !schedule_.meshUnderWay()) return {outdatedMesh()};
  // A backend that failed may still have its map, as a GPU does that has run out of memory.
  try {
    if (schedule_.meshUnderWay()) finishMesh();
    if (!schedule_.meshOutdated()) return {};
    beginMesh();
    finishMesh();
  } catch (const std::exception& error) {
    fail(errorText(error));
    return {outdatedMesh()};
  }
  return {"", mesh_is_part_};
}

void MapSession::noteCleared(const Region& region) {
  if (parts_.log != nullptr) parts_.log->cleared(region);
  schedule_.frameFused();  // the mesh and the report are as outdated as after a frame
}

ClearedRegion MapSession::clearRegion(const Region& region) {
  throwIfFailed();
  const std::string problem = findProblem(region);
  if (!problem.empty()) throw std::runtime_error(problem);  // the caller's, not the backend's
  try {
    const ClearedRegion cleared = mapper_->clearRegion(region);
    noteCleared(region);
    return cleared;
  } catch (const PartlyCleared&) {  // the disk failed, not the backend
    noteCleared(region);
    throw;
  } catch (const std::exception& error) {
    fail(errorText(error));
    throw;
  }
}

void MapSession::correct(MapCorrection::Request request) {
  throwIfFailed();
  parts_.correction->add(std::move(request), mapper_->stats());
}

void MapSession::correctMap() {
  auto corrected = parts_.correction->step(report_.stats);
  if (corrected) takePlace(std::move(*corrected));
}

/// The map of corrected poses, which has all frames that this one has.
void MapSession::takePlace(MapCorrection::Corrected corrected) {
  if (schedule_.meshUnderWay()) finishMesh();
  mapper_.swap(corrected.mapper);
  schedule_.cleared();
  mesh_whole_ = true;
  mesh_stamp_ = map_stamp_;
  parts_.mesh_changes.replaceAll(std::move(corrected.mesh), mesh_stamp_);
  if (Space* const replaced = corrected.mapper->space()) handOverChangesOf(*replaced);
  parts_.correction->finish(std::move(corrected.mapper));
  updateReport();
}

/// Of the space that was handed over so far.
void MapSession::handOverChangesOf(Space& replaced) {
  if (parts_.space == nullptr) return;
  Space& now = *mapper_->space();
  surfaces_stamp_ = space_stamp_ = mesh_stamp_;
  space_is_part_ = false;
  parts_.space->add(allChangesOf(replaced), now.cellSize_m(), mesh_stamp_);
  parts_.space->add(changesBetween(replaced, allChangesOf(now).cubes), now.cellSize_m(),
                    mesh_stamp_);
}

void MapSession::forgetFailure() {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.loaded_map.clear();
  if (!hasFailed()) return;
  ROS_INFO_NAMED("dtsdf_mapping", "the map was restarted after a failure; frames are fused again");
  report_.failure.clear();
}

void MapSession::updateReport() {
  schedule_.reported();
  const MapStats stats = mapper_->stats();
  const MapperMemory memory = mapper_->memory();
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.stats = stats;
  report_.memory = memory;
}

void MapSession::throwIfFailed() const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  if (!hasFailed()) return;
  throw std::runtime_error("the map's backend has failed (" + report_.failure +
                           "); call clear_map to start over");
}

void MapSession::fail(const std::string& text) {
  ROS_FATAL_STREAM_NAMED("dtsdf_mapping",
                         "the map's backend failed; call clear_map to start over: " << text);
  if (parts_.correction != nullptr) parts_.correction->giveUp("the map's backend failed");
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.failure = text;
}

MapReport MapSession::report() const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  return report_;
}

}  // namespace dtsdf
