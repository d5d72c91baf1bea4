#include "log/log_replay.h"

#include <utility>

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

}  // namespace dtsdf
