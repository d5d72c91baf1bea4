#include "log/log_queue.h"

#include <exception>
#include <type_traits>
#include <utility>

#include "params/printable.h"

namespace dtsdf {

LogQueue::LogQueue(Options options)
    : options_(std::move(options)), log_(options_.log), thread_([this] { loop(); }) {}

LogQueue::~LogQueue() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void LogQueue::begin(LogBegin begin, WriteMap write_map) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    begin.continues = begin.continues && !has_gap_;
    has_gap_ = false;
    ++begins_waiting_;
  }
  Entry entry;
  entry.begins = true;
  entry.write = [begin = std::move(begin), write_map = std::move(write_map)](FrameLog& log) {
    log.begin(begin, write_map);
  };
  push(std::move(entry));
}

template <class Frame>
void LogQueue::addImage(const Frame& frame, double stamp_s, uint32_t camera,
                        std::shared_ptr<const void> pixels) {
  Entry entry;
  entry.bytes = frame.row_bytes * static_cast<size_t>(frame.height);
  entry.write = [frame, stamp_s, camera, pixels = std::move(pixels)](FrameLog& log) {
    const LogRecord record = toRecord(frame, stamp_s, camera);
    // Corrections name the first camera's images: others need not have stamps in their order.
    if (std::is_same_v<Frame, DepthFrame> && camera == 0) return log.add(record, stamp_s);
    log.add(record);
  };
  push(std::move(entry));
}

void LogQueue::add(const DepthFrame& frame, double stamp_s, uint32_t camera,
                   std::shared_ptr<const void> pixels) {
  addImage(frame, stamp_s, camera, std::move(pixels));
}

void LogQueue::add(const ColourFrame& frame, double stamp_s, uint32_t camera,
                   std::shared_ptr<const void> pixels) {
  addImage(frame, stamp_s, camera, std::move(pixels));
}

void LogQueue::add(const Region& region) {
  push({[region](FrameLog& log) { log.add(toRecord(region)); }});
}

void LogQueue::addLevel(const Eigen::Isometry3d& T_W_M) {
  push({[T_W_M](FrameLog& log) { log.add(levelRecord(T_W_M)); }});
}

void LogQueue::add(const LogCorrection& correction) {
  push({[correction](FrameLog& log) { log.add(toRecord(correction), correction); }});
}

std::future<std::optional<LogMark>> LogQueue::mark() {
  Entry entry;
  entry.mark.emplace();
  std::future<std::optional<LogMark>> mark = entry.mark->get_future();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (has_gap_) {
      entry.mark->set_value(std::nullopt);
      return mark;
    }
  }
  push(std::move(entry));
  return mark;
}

void LogQueue::push(Entry entry) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (has_gap_ && !entry.mark) {
      ++report_.lost;
      return;
    }
    if (waiting_bytes_ + entry.bytes > options_.max_bytes) {
      ++report_.lost;
      noteGap("the disk is too slow: images were not logged");
      return;
    }
    waiting_bytes_ += entry.bytes;
    entries_.push_back(std::move(entry));
  }
  changed_.notify_all();
}

void LogQueue::loop() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || !entries_.empty(); });
    if (entries_.empty()) return;
    Entry entry = std::move(entries_.front());
    entries_.pop_front();
    lock.unlock();
    take(entry);
    const size_t bytes = entry.bytes;
    entry = Entry();  // its image goes before the room is given back
    lock.lock();
    waiting_bytes_ -= bytes;
  }
}

void LogQueue::take(Entry& entry) {
  if (entry.mark) {
    entry.mark->set_value(log_.isWhole() ? std::optional<LogMark>(log_.mark()) : std::nullopt);
    return;
  }
  if (entry.begins) {
    const std::lock_guard<std::mutex> lock(mutex_);
    --begins_waiting_;
  } else if (!log_.isWhole()) {  // what waited behind a failure
    const std::lock_guard<std::mutex> lock(mutex_);
    ++report_.lost;
    return;
  }
  try {
    entry.write(log_);
    noteState();
  } catch (const std::exception& error) {
    noteFailure(errorText(error));
  }
}

void LogQueue::noteState() {
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.bytes = log_.bytes();
  report_.first_stamp_s = log_.firstStamp_s();
  log_wants_map_ = log_.wantsMap();
  failed_at_.reset();
  if (!has_gap_) report_.problem.clear();
}

void LogQueue::noteFailure(const std::string& problem) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++report_.lost;
  report_.bytes = log_.bytes();
  report_.first_stamp_s.reset();
  noteGap(problem);
  failed_at_ = std::chrono::steady_clock::now();
}

void LogQueue::noteGap(const std::string& problem) {
  has_gap_ = true;
  report_.problem = problem + "; it begins again with a copy of the map as soon as it can";
}

bool LogQueue::wantsMap() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (begins_waiting_ > 0) return false;
  if (!has_gap_) return log_wants_map_;
  return !failed_at_ || std::chrono::steady_clock::now() - *failed_at_ >= options_.retry_after;
}

LogReport LogQueue::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  LogReport report = report_;
  report.waiting_bytes = waiting_bytes_;
  if (has_gap_) report.first_stamp_s.reset();
  return report;
}

}  // namespace dtsdf
