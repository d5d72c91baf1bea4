#include "dtsdf_mapping/io/prefetched_frames.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace dtsdf {
namespace {

class PrefetchedFrames : public FrameSource {
 public:
  PrefetchedFrames(std::unique_ptr<FrameSource> source, size_t capacity)
      : source_(std::move(source)),
        size_(source_->size()),
        posed_(source_->posed()),
        capacity_(capacity) {
    reader_ = std::thread([this] { run(); });
  }

  ~PrefetchedFrames() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    reader_.join();
  }

  std::optional<size_t> size() const override { return size_; }
  std::optional<size_t> posed() const override { return posed_; }
  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

  std::optional<SourceFrame> next() override {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_.empty() || failure_; });
    if (waiting_.empty()) std::rethrow_exception(failure_);
    Item item = waiting_.front();          // cheap: the pixels are shared
    if (item.frame) waiting_.pop_front();  // the end stays, for whoever asks again
    lock.unlock();
    changed_.notify_all();
    skipped_ = std::move(item.skipped);
    if (item.error) std::rethrow_exception(item.error);
    return std::move(item.frame);
  }

 private:
  /// What one next() of the inner source gave: a frame, an error or the end.
  struct Item {
    std::optional<SourceFrame> frame;
    std::exception_ptr error;
    std::map<std::string, size_t> skipped;
  };

  /// The reader thread. What fails beside the source itself, for want of memory, is handed on, too.
  void run() noexcept {
    try {
      readAhead();
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      failure_ = std::current_exception();
    }
    changed_.notify_all();
  }

  /// On the reader thread, the only one that touches source_.
  void readAhead() {
    bool at_end = false;
    while (!at_end) {
      Item item = readOne();
      at_end = !item.frame;
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [this] { return stopped_ || waiting_.size() < capacity_; });
      if (stopped_) return;
      waiting_.push_back(std::move(item));
      lock.unlock();
      changed_.notify_all();
    }
  }

  Item readOne() {
    Item item;
    try {
      item.frame = source_->next();
    } catch (...) {
      item.error = std::current_exception();
    }
    item.skipped = source_->skipped();
    return item;
  }

  const std::unique_ptr<FrameSource> source_;
  const std::optional<size_t> size_, posed_;
  const size_t capacity_;
  std::map<std::string, size_t> skipped_;  ///< Of the consumer's thread.

  std::mutex mutex_;  ///< Guards the three below.
  std::deque<Item> waiting_;
  bool stopped_ = false;
  std::exception_ptr failure_;  ///< That ended the reader thread.
  std::condition_variable changed_;
  std::thread reader_;
};

}  // namespace

std::unique_ptr<FrameSource> prefetchFrames(std::unique_ptr<FrameSource> source, size_t capacity) {
  return std::make_unique<PrefetchedFrames>(std::move(source), capacity > 0 ? capacity : 1);
}

}  // namespace dtsdf
