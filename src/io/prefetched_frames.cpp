#include "dtsdf_mapping/io/prefetched_frames.h"

#include <exception>
#include <utility>

#include "threads/helper.h"

namespace dtsdf {
namespace {

class PrefetchedFrames : public FrameSource {
 public:
  explicit PrefetchedFrames(std::unique_ptr<FrameSource> source)
      : source_(std::move(source)), size_(source_->size()), posed_(source_->posed()) {
    readOne();
  }

  std::optional<size_t> size() const override { return size_; }
  std::optional<size_t> posed() const override { return posed_; }

  std::optional<SourceFrame> next() override {
    helper_.wait();
    skipped_ = next_skipped_;
    problems_ = next_problems_;
    if (error_ != nullptr) std::rethrow_exception(error_);
    std::optional<SourceFrame> frame = std::move(next_);
    if (frame) readOne();
    return frame;
  }

 private:
  /// Until next() waits for the helper, only the helper uses the source.
  void readOne() {
    next_.reset();
    helper_.start([this] {
      try {
        next_ = source_->next();
        next_skipped_ = source_->skipped();
        next_problems_ = source_->problems();
      } catch (...) {
        error_ = std::current_exception();
      }
    });
  }

  const std::unique_ptr<FrameSource> source_;
  const std::optional<size_t> size_, posed_;
  std::map<std::string, size_t> next_skipped_;
  std::map<std::string, std::string> next_problems_;
  std::optional<SourceFrame> next_;
  std::exception_ptr error_;  ///< Thrown by next(), from then on.
  Helper helper_;             ///< Destroyed first, before the members it uses.
};

}  // namespace

std::unique_ptr<FrameSource> prefetchFrames(std::unique_ptr<FrameSource> source) {
  return std::make_unique<PrefetchedFrames>(std::move(source));
}

}  // namespace dtsdf
