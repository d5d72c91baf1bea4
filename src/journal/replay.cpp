#include "journal/replay.h"

#include <algorithm>
#include <stdexcept>

#include "params/printable.h"

namespace dtsdf {
namespace {

bool isImage(const Record& record) {
  return record.is(journal::kDepth) || record.is(journal::kColour);
}

void noteMove(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
              CorrectionEffect& effect) {
  const Eigen::Isometry3d T = from.inverse() * to;
  ++effect.moved;
  effect.farthest_m = std::max(effect.farthest_m, T.translation().norm());
  effect.farthest_rad = std::max(effect.farthest_rad, Eigen::AngleAxisd(T.linear()).angle());
}

}  // namespace

bool isJournal(const std::string& path) { return RecordFile::hasPurpose(path, journal::kPurpose); }

JournalReplay::JournalReplay(const std::string& path)
    : file_(std::make_shared<RecordFile>(path, journal::kPurpose, "journal")) {
  if (file_->records().empty()) file_->throwDamaged("it ends before the map begins");
  begin_ = journal::readBegin(*file_, 0);
  if (begin_.has_map) {
    map_ = std::make_shared<const MapChunks>(file_, next_record_);
    T_W_M_ = map_->head().T_W_M;
    next_record_ = map_->endRecord();
  }
  readAppended();
}

bool JournalReplay::isWhole(size_t record) const {
  try {
    journal::readCall(*file_, record);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

std::string JournalReplay::incompleteEnd() const {
  const std::vector<Record>& records = file_->records();
  uint64_t end = file_->end();
  if (next_record_ < records.size()) end = records[next_record_].offset - kRecordHeadBytes;
  if (end == file_->bytes()) return "";
  return "the last " + std::to_string(file_->bytes() - end) + " bytes of the journal '" +
         printable(file_->path()) + "' are incomplete or damaged, and are ignored";
}

/// Adds an image only once its pixels are in the file, and the last record only once it is
/// complete.
bool JournalReplay::readAppended() {
  file_->readAppended();
  const std::vector<Record>& records = file_->records();
  const size_t before = next_record_;
  while (next_record_ < records.size()) {
    const size_t end = next_record_ + (isImage(records[next_record_]) ? 2 : 1);
    if (end > records.size() || (end == records.size() && !isWhole(next_record_))) break;
    add(next_record_);
    next_record_ = end;
  }
  return next_record_ > before;
}

void JournalReplay::add(size_t record) {
  const journal::Call call = journal::readCall(*file_, record, false);
  Item item;
  item.record = record;
  if (const auto* const image = std::get_if<journal::Image>(&call)) {
    item.is_image = true;
    item.is_depth = std::holds_alternative<DepthFrame>(image->frame);
    item.is_first_camera = item.is_depth && image->camera == 0;
    item.stamp_s = image->stamp_s;
    item.T_W_C = std::visit([](const auto& frame) { return frame.T_W_C; }, image->frame);
    if (running_) item.T_W_C = correctNext(*running_, item);
    depth_images_ += item.is_depth;
  } else if (const auto* const correction = std::get_if<journal::Correction>(&call)) {
    correct(*correction);
    running_.reset();  // images after the correction were fused at corrected poses
  } else if (const auto* const level = std::get_if<journal::Level>(&call)) {
    T_W_M_ = level->T_W_M;
  }
  items_.push_back(item);
}

/// The corrected pose of an image. Whether the source has adopted the correction is decided only
/// from the images up to this one, since the images after it may not be in the journal yet.
Eigen::Isometry3d JournalReplay::correctNext(Running& running, const Item& item) {
  const StampedPose given{item.stamp_s, item.T_W_C};
  const bool is_named = given.stamp_s <= running.poses.last_s();
  if (item.is_first_camera) {
    const Eigen::Isometry3d motion =
        is_named ? Eigen::Isometry3d::Identity() : running.poses.lastMotion();
    if (running.given.adoptsCorrection(motion, given)) running.is_adopted = true;
  }
  if (running.is_adopted) return item.T_W_C;
  return running.poses.correct(given.stamp_s, item.T_W_C);
}

/// Index of the call with which the newest recording begins, among the first `before` calls; 0 if
/// there is only one recording.
size_t JournalReplay::beginOfRecording(uint64_t before) const {
  size_t begin = 0;
  double newest_s = -HUGE_VAL;
  for (size_t i = 0; i < items_.size() && i < before; ++i) {
    if (!items_[i].is_first_camera) continue;
    if (items_[i].stamp_s < newest_s - GivenMotion::kBegin_s) begin = i;
    newest_s = items_[i].stamp_s;
  }
  return begin;
}

std::vector<StampedPose> JournalReplay::firstCamera(size_t pass, uint64_t before) const {
  std::vector<StampedPose> poses;
  for (size_t i = pass; i < items_.size() && i < before; ++i) {
    if (items_[i].is_first_camera) poses.push_back({items_[i].stamp_s, items_[i].T_W_C});
  }
  return Trajectory(std::move(poses)).poses();
}

CorrectionEffect JournalReplay::correct(const journal::Correction& correction) {
  const size_t pass = beginOfRecording(correction.before);
  Running running{PoseCorrection(correction.poses, firstCamera(pass, correction.before))};
  CorrectionEffect effect;
  for (size_t i = pass; i < items_.size(); ++i) {
    Item& item = items_[i];
    if (!item.is_image) continue;
    const Eigen::Isometry3d T_W_C = correctNext(running, item);
    if (T_W_C.matrix() == item.T_W_C.matrix()) continue;
    if (item.is_depth) noteMove(item.T_W_C, T_W_C, effect);
    item.T_W_C = T_W_C;
  }
  running_.emplace(std::move(running));
  return effect;
}

CorrectionEffect JournalReplay::correctGiven(std::vector<StampedPose> poses_M) {
  if (T_W_M_) {
    for (StampedPose& pose : poses_M) pose.T_W_C = *T_W_M_ * pose.T_W_C;
  }
  return correct({count(), std::move(poses_M)});
}

Eigen::Isometry3d JournalReplay::motion() const {
  if (!running_ || running_->is_adopted) return Eigen::Isometry3d::Identity();
  return running_->poses.lastMotion();
}

std::optional<journal::Call> JournalReplay::next() {
  while (next_ < items_.size()) {
    const Item& item = items_[next_++];
    journal::Call call = journal::readCall(*file_, item.record);
    if (std::holds_alternative<Region>(call)) return call;
    auto* const image = std::get_if<journal::Image>(&call);
    if (image == nullptr) continue;
    auto* const depth = std::get_if<DepthFrame>(&image->frame);
    if (depth != nullptr && depth->keep_center_W && item.T_W_C.matrix() != depth->T_W_C.matrix()) {
      depth->keep_center_W = item.T_W_C * (depth->T_W_C.inverse() * *depth->keep_center_W);
    }
    std::visit([&item](auto& frame) { frame.T_W_C = item.T_W_C; }, image->frame);
    return call;
  }
  return std::nullopt;
}

std::unique_ptr<Mapper> mapperOf(const JournalReplay& journal, const MapperParams& params) {
  return journal.map() ? makeMapper(params, partsOf(journal.map())) : makeMapper(params);
}

IntegrationResult repeatCall(const journal::Call& call, Mapper& mapper) {
  if (const auto* const region = std::get_if<Region>(&call)) {
    mapper.clearRegion(*region);
    return {};
  }
  const auto& frame = std::get<journal::Image>(call).frame;
  const auto* const depth = std::get_if<DepthFrame>(&frame);
  return depth ? mapper.integrate(*depth) : mapper.paint(std::get<ColourFrame>(frame));
}

}  // namespace dtsdf
