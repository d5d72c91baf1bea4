#include "dtsdf_mapping/io/prefetched_frames.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

/// Frames with stamps 0, 1, ...; one was skipped before each; may end in an error.
class CountingFrames : public FrameSource {
 public:
  CountingFrames(int count, bool breaks) : count_(count), breaks_(breaks) {}

  std::optional<size_t> size() const override { return 2 * count_; }
  const std::map<std::string, size_t>& skipped() const override { return skipped_; }
  std::optional<SourceFrame> next() override {
    if (next_ == count_ && breaks_) throw std::runtime_error("broken");
    if (next_ == count_) return std::nullopt;
    ++skipped_["some reason"];
    SourceFrame frame;
    frame.stamp_s = next_++;
    return frame;
  }

 private:
  int count_, next_ = 0;
  bool breaks_;
  std::map<std::string, size_t> skipped_;
};

std::unique_ptr<FrameSource> prefetched(int count, bool breaks) {
  return prefetchFrames(std::make_unique<CountingFrames>(count, breaks));
}

TEST(PrefetchedFrames, HandsOutTheSameFramesInOrder) {
  const auto source = prefetched(20, false);
  EXPECT_EQ(source->size(), 40u);
  for (size_t i = 0; i < 20; ++i) {
    const auto frame = source->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->stamp_s, static_cast<double>(i));
    EXPECT_EQ(source->skipped().at("some reason"), i + 1);
  }
  EXPECT_FALSE(source->next());
  EXPECT_FALSE(source->next());
}

TEST(PrefetchedFrames, ThrowsAnErrorInItsTurn) {
  const auto source = prefetched(2, true);
  EXPECT_TRUE(source->next());
  EXPECT_TRUE(source->next());
  EXPECT_EQ(errorOf([&] { source->next(); }), "broken");
  EXPECT_EQ(errorOf([&] { source->next(); }), "broken");
}

TEST(PrefetchedFrames, MayBeLeftEarly) {
  for (int taken = 0; taken < 5; ++taken) {
    const auto source = prefetched(100, false);
    for (int i = 0; i < taken; ++i) source->next();
  }
}

}  // namespace
}  // namespace dtsdf
