#include "tools/reconstruction.h"

#include <gtest/gtest.h>

#include "support/fake_mapper.h"
#include "support/temporary_folder.h"
#include "tools/reconstruction_report.h"

namespace dtsdf {
namespace {

/// Accepts only frames with a positive width.
class OrderedMapper : public FakeMapper {
 public:
  IntegrationResult integrate(const DepthFrame& frame) override {
    calls += 'i';
    IntegrationResult result;
    if (frame.width <= 0) result.status = FrameStatus::kBadImage;
    return result;
  }
  IntegrationResult paint(const ColourFrame&) override {
    calls += 'p';
    return {};
  }
  void beginMeshUpdate() override { calls += 'm'; }

  /// One character per call: 'i' for a frame, 'p' for a colour image, 'm' for an extraction.
  std::string calls;
};

/// Returns frames with these widths and reports three additional frames as skipped.
class FakeSource : public FrameSource {
 public:
  explicit FakeSource(std::vector<int> widths) : widths_(std::move(widths)) {}
  std::optional<size_t> size() const override { return widths_.size() + 3; }
  const std::map<std::string, size_t>& skipped() const override { return skipped_; }
  std::optional<SourceFrame> next() override {
    if (next_ == widths_.size()) return std::nullopt;
    SourceFrame frame;
    frame.depth.width = widths_[next_++];
    frame.stamp_s = static_cast<double>(next_);
    return frame;
  }

 private:
  std::vector<int> widths_;
  size_t next_ = 0;
  std::map<std::string, size_t> skipped_{{"no pose", 3}};
};

/// Returns images with these stamps and reports one additional image as skipped.
class FakeColours : public ColourSource {
 public:
  explicit FakeColours(std::vector<double> stamps_s) : stamps_s_(std::move(stamps_s)) {}
  const std::map<std::string, size_t>& skipped() const override { return skipped_; }
  std::optional<SourceColour> next() override {
    if (next_ == stamps_s_.size()) return std::nullopt;
    SourceColour image;
    image.stamp_s = stamps_s_[next_++];
    return image;
  }

 private:
  std::vector<double> stamps_s_;
  size_t next_ = 0;
  std::map<std::string, size_t> skipped_{{"colour without pose", 1}};
};

class ReconstructionTest : public testing::Test {
 protected:
  ReconstructionResult run(const RecordedInput& input) {
    return reconstruct(input, mapper_, MapParams(), 0, [](size_t) {});
  }

  OrderedMapper mapper_;
};

/// The frames have stamps 1, 2 and 3.
TEST_F(ReconstructionTest, PaintsInTheOrderOfStamps) {
  FakeSource source({1, 1, 1});
  FakeColours colours({0.5, 1.0, 1.5, 1.6, 3.0, 3.1});
  const ReconstructionResult result = run({source, &colours});
  EXPECT_EQ(mapper_.calls, "ipppiipm");
  EXPECT_EQ(result.images, 4u);
  EXPECT_EQ(result.paint_ms.size(), 4u);
  EXPECT_EQ(result.skipped.at("colour without pose"), 1u);
}

/// The map contains all images up to its stamp, -1. Colour images after this stamp are painted,
/// even those before the first frame.
TEST_F(ReconstructionTest, PaintsOnlyImagesNewToTheMap) {
  FakeSource source({1, 1});
  FakeColours colours({-2.0, -1.0, 0.5, 1.5});
  RecordedInput input(source, &colours);
  input.map_stamp_s = -1.0;
  const ReconstructionResult result = run(input);
  EXPECT_EQ(mapper_.calls, "pipim");
  EXPECT_EQ(result.stamp_s, 2.0);
}

TEST_F(ReconstructionTest, CountsSkippedFramesByReason) {
  FakeSource source({1, 0, 1});
  const ReconstructionResult result = run(source);
  EXPECT_EQ(result.frames, 2u);
  EXPECT_EQ(result.skipped.at("no pose"), 3u);
  EXPECT_EQ(result.skipped.at(toString(FrameStatus::kBadImage)), 1u);
  EXPECT_NE(describeSkipped(result.skipped).find("3 x no pose"), std::string::npos);
}

TEST_F(ReconstructionTest, ExplainsWhyNoFrameWasFused) {
  FakeSource source({0, 0});
  const std::string error = errorOf([&] { run(source); });
  EXPECT_NE(error.find("3 x no pose"), std::string::npos) << error;
}

TEST(Summary, HasMeanMedianP95AndWorst) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  EXPECT_DOUBLE_EQ(summarise(values).mean, 50.5);
  EXPECT_DOUBLE_EQ(summarise(values).median, 50.5);
  EXPECT_DOUBLE_EQ(summarise(values).p95, 95.0);
  EXPECT_DOUBLE_EQ(summarise({3.0, 1.0, 2.0}).median, 2.0);
  EXPECT_DOUBLE_EQ(summarise(values).worst, 100.0);
  EXPECT_DOUBLE_EQ(summarise(std::vector<double>{}).mean, 0.0);
}

}  // namespace
}  // namespace dtsdf
