#include "io/wrapped_images.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "support/error_of.h"

namespace dtsdf {
namespace {

/// Returns frames with stamps 0, 1, ... and counts one skipped frame before each. If `breaks` is
/// set, an exception is thrown after the last frame.
class CountingFrames : public FrameSource {
 public:
  CountingFrames(int count, bool breaks) : count_(count), breaks_(breaks) {}

  std::optional<size_t> size() const override { return 2 * count_; }
  std::optional<SourceFrame> next() override {
    if (next_ == count_ && std::exchange(breaks_, false)) throw std::runtime_error("broken");
    if (next_ == count_) return std::nullopt;
    ++skipped_["some reason"];
    SourceFrame frame;
    frame.stamp_s = next_++;
    return frame;
  }

 private:
  int count_, next_ = 0;
  bool breaks_;
};

std::unique_ptr<FrameSource> framesReadAhead(int count, bool breaks) {
  return readAhead(std::make_unique<CountingFrames>(count, breaks));
}

TEST(ReadAhead, ReturnsTheSameFramesInOrder) {
  const auto source = framesReadAhead(20, false);
  EXPECT_EQ(source->size(), 40u);
  for (int i = 0; i < 20; ++i) {
    const auto frame = source->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->stamp_s, static_cast<double>(i));
  }
  EXPECT_FALSE(source->next());
  EXPECT_FALSE(source->next());
  EXPECT_EQ(source->skipped().at("some reason"), 20u);
}

TEST(ReadAhead, ErrorsArriveInOrderAndPersist) {
  const auto source = framesReadAhead(2, true);
  EXPECT_TRUE(source->next());
  EXPECT_TRUE(source->next());
  EXPECT_EQ(errorOf([&] { source->next(); }), "broken");
  EXPECT_EQ(errorOf([&] { source->next(); }), "broken");
}

TEST(ReadAhead, CanBeStoppedEarly) {
  for (int taken = 0; taken < 5; ++taken) {
    const auto source = framesReadAhead(100, false);
    for (int i = 0; i < taken; ++i) source->next();
  }
}

}  // namespace
}  // namespace dtsdf
