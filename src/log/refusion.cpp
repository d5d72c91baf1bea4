#include "log/refusion.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include "io/map_chunks.h"
#include "kernels/core/grid.h"

namespace dtsdf {
namespace {

LoggedDepth depthAt(const LoggedPoses::Item& item) {
  LoggedDepth depth = readDepth(readRecord(item.entry));
  DepthFrame& frame = depth.frame;
  if (frame.keep_center_W && item.T_W_C.matrix() != frame.T_W_C.matrix()) {
    frame.keep_center_W = item.T_W_C * (frame.T_W_C.inverse() * *frame.keep_center_W);
  }
  frame.T_W_C = item.T_W_C;
  return depth;
}

LoggedColour colourAt(const LoggedPoses::Item& item) {
  LoggedColour colour = readColour(readRecord(item.entry));
  colour.frame.T_W_C = item.T_W_C;
  return colour;
}

}  // namespace

LogReplay::LogReplay(const std::string& folder)
    : reader_(folder), bases_(reader_.bases()), bases_read_(bases_.size()) {
  readOn();
}

bool LogReplay::readOn() {
  const size_t before = poses_.items().size();
  while (std::optional<LogEntry> entry = reader_.next()) {
    const std::vector<LogBase>& all = reader_.bases();
    for (; bases_read_ < all.size(); ++bases_read_) bases_.push_back(all[bases_read_]);
    if (entry->head.kind == LogKind::kCorrection) outdate(readCorrection(entry->description));
    if (entry->head.kind == LogKind::kLevel) T_W_M_ = readLevel(entry->description);
    if (entry->head.kind == LogKind::kDepth) ++depth_images_;
    poses_.add(std::move(*entry));
  }
  return poses_.items().size() > before;
}

/// Maps whose images were moved since.
void LogReplay::outdate(const LogCorrection& correction) {
  while (bases_.size() > 1 && bases_.back().number > correction.first_moved) bases_.pop_back();
}

std::string LogReplay::startOver(uint64_t number) {
  size_t base = bases_.size() - 1;
  while (base > 0 && bases_[base].number > number) --base;
  next_ = depth_images_ = 0;
  for (const LoggedPoses::Item& item : poses_.items()) {
    if (item.entry.head.number < bases_[base].number) {
      ++next_;
    } else if (item.entry.head.kind == LogKind::kDepth) {
      ++depth_images_;
    }
  }
  return bases_[base].path;
}

CorrectionEffect LogReplay::effectOf(const LogCorrection& correction) const {
  return poses_.effectOf(correction, reader_.hasLostImages());
}

CorrectionEffect LogReplay::correct(const LogCorrection& correction) {
  return poses_.correct(correction, reader_.hasLostImages());
}

std::optional<LogCall> LogReplay::next() {
  while (next_ < poses_.items().size()) {
    const LoggedPoses::Item& item = poses_.items()[next_++];
    LogCall call;
    call.stamp_s = item.image.stamp_s;
    call.number = item.entry.head.number;
    switch (item.entry.head.kind) {
      case LogKind::kDepth: call.content = depthAt(item); return call;
      case LogKind::kColour: call.content = colourAt(item); return call;
      case LogKind::kClearRegion: call.content = readRegion(item.entry.description); return call;
      default: break;
    }
  }
  return std::nullopt;
}

uint64_t LogReplay::nextNumber() const { return reader_.nextNumber(); }

bool LogReplay::isHandedOut(uint64_t number) const {
  return next_ > 0 && number <= poses_.items()[next_ - 1].entry.head.number;
}

IntegrationResult apply(const LogCall& call, Mapper& mapper) {
  if (const auto* const depth = std::get_if<LoggedDepth>(&call.content)) {
    return mapper.integrate(depth->frame);
  }
  if (const auto* const colour = std::get_if<LoggedColour>(&call.content)) {
    return mapper.paint(colour->frame);
  }
  mapper.clearRegion(std::get<Region>(call.content));
  return {};
}

namespace {

/// So that the whole mesh need not be made at once when the maps are swapped.
constexpr size_t kCallsPerMesh = 64;
/// How often the memory is looked at: to ask for it is to wait for a GPU.
constexpr size_t kCallsPerCheck = 8;
/// The mesh of so few is made when the maps are swapped.
constexpr size_t kFewCalls = 8;

std::string inMb(size_t bytes) { return std::to_string(bytes >> 20) + " MB"; }

std::string tooLarge(size_t live_bytes, size_t second_bytes, size_t max_bytes) {
  return "the map takes " + inMb(live_bytes) + " and a corrected one beside it " +
         inMb(second_bytes) + ", more than the " + inMb(max_bytes) +
         " of map/max_memory_mb; raise it";
}

}  // namespace

std::string whyTooLarge(const MapStats& live) {
  if (2 * live.map_bytes <= live.max_map_bytes) return "";
  return tooLarge(live.map_bytes, live.map_bytes, live.max_map_bytes);
}

Refusion::Refusion(const std::string& log_folder, const MapperParams& run)
    : replay_(log_folder), params_(readMapperParams(replay_.settings())) {
  params_.backend = run.backend;
  params_.threads = run.threads;
}

void Refusion::begin() {
  mapper_.reset();  // before there is another one
  mesh_.clear();
  fused_ = bytes_ = 0;
  uint64_t first_moved = replay_.nextNumber();
  for (const LogCorrection& correction : corrections_) {
    first_moved = std::min(first_moved, correction.first_moved);
  }
  const std::string base = replay_.startOver(first_moved);
  mapper_ = base.empty() ? makeMapper(params_)
                         : makeMapper(params_, partsOf(std::make_shared<const MapChunks>(base)));
  calls_since_mesh_ = base.empty() ? 0 : 1;
  has_to_begin_ = false;
}

void Refusion::readUpTo(uint64_t number) {
  while (replay_.readOn()) {
  }
  if (replay_.nextNumber() >= number) return;
  throw std::runtime_error("the log cannot be read beyond its record " +
                           std::to_string(replay_.nextNumber() - 1));
}

CorrectionEffect Refusion::effectOf(const LogCorrection& correction) {
  readUpTo(correction.before);
  return replay_.effectOf(correction);
}

bool Refusion::isTooLateFor(const CorrectionEffect& effect) const {
  return !has_to_begin_ && replay_.isHandedOut(effect.first_moved);
}

void Refusion::correct(LogCorrection correction) {
  readUpTo(correction.before);
  const CorrectionEffect effect = replay_.correct(correction);
  has_to_begin_ = has_to_begin_ || isTooLateFor(effect);
  correction.first_moved = effect.first_moved;
  corrections_.push_back(std::move(correction));
}

bool Refusion::step(size_t live_bytes) {
  std::optional<LogCall> call = replay_.next();
  if (!call && replay_.readOn()) call = replay_.next();
  if (call) {
    fuse(*call);
    if (calls_since_mesh_ % kCallsPerCheck == 0) checkMemory(live_bytes);
    if (calls_since_mesh_ >= kCallsPerMesh) extract();
    return true;
  }
  if (calls_since_mesh_ < kFewCalls) return false;
  extract();
  return true;
}

void Refusion::fuse(const LogCall& call) {
  const IntegrationResult result = apply(call, *mapper_);
  if (result.status == FrameStatus::kNoMemory) throw std::runtime_error(result.message);
  if (std::holds_alternative<LoggedDepth>(call.content)) ++fused_;
  ++calls_since_mesh_;
}

void Refusion::checkMemory(size_t live_bytes) {
  const MapStats stats = mapper_->stats();
  bytes_ = stats.map_bytes;
  if (live_bytes + stats.map_bytes <= stats.max_map_bytes) return;
  throw std::runtime_error(tooLarge(live_bytes, stats.map_bytes, stats.max_map_bytes));
}

void Refusion::extract() {
  for (BlockMesh& block : mapper_->updateMesh().blocks) {
    const PackedKey key = packKey(block.key);
    if (block.triangles.empty()) {
      mesh_.erase(key);
    } else {
      mesh_[key] = std::move(block);
    }
  }
  calls_since_mesh_ = 0;
}

std::map<PackedKey, BlockMesh> Refusion::takeMesh() {
  if (calls_since_mesh_ > 0) extract();
  return std::move(mesh_);
}

}  // namespace dtsdf
