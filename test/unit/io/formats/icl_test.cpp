/// Tests reading a short recording laid out like the TUM-compatible living room archives of
/// ICL-NUIM.
#include <gtest/gtest.h>

#include "support/recording_folder.h"

namespace dtsdf {
namespace {

class IclArchive : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 3; ++i) {
      const std::string number = std::to_string(i);
      writeDepthImage(folder_ / ("depth/" + number + ".png"), 640, 480, i + 1);
      associations_ += number + " depth/" + number + ".png " + number + " rgb/" + number + ".png\n";
    }
    writeBytes(folder_ / "associations.txt", associations_);
    writeBytes(folder_ / "livingRoom0.gt.freiburg",
               "1 0 0 -2.25 0 0 0 1\n2 0.000466347 0.00895357 -2.24935 0 0 0 1\n\n");
    options_.path = folder_.path();
  }

  void expectError(const std::string& file, const std::string& text,
                   const std::string& expected) const {
    const std::string whole = readBytes(folder_ / file);
    writeBytes(folder_ / file, text);
    EXPECT_NE(readingErrorOf(options_).find(expected), std::string::npos)
        << text << " -> " << readingErrorOf(options_);
    writeBytes(folder_ / file, whole);
  }

  TemporaryFolder folder_;
  std::string associations_;
  RecordingOptions options_;
};

TEST_F(IclArchive, MatchesByNumberAndSkipsImage0) {
  EXPECT_EQ(guessRecordingFormat(options_.path), "icl");
  const auto source = openRecording(options_);
  EXPECT_EQ(source->size(), 3u);
  EXPECT_EQ(source->posed(), 2u);
  const std::vector<SourceFrame> frames = readAll(*source);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].stamp_s, 1.0);
  EXPECT_EQ(frames[1].depth.T_W_C.translation().y(), 0.00895357);
  EXPECT_EQ(source->skipped(),
            (std::map<std::string, size_t>{{"no pose with the same number", 1}}));
}

// With the published intrinsics, y = (v - 239.5) z / -480, so y points up.
TEST_F(IclArchive, FlippingRowsKeepsThePoints) {
  const auto image1 = openRecording(options_)->next();
  const DepthFrame& frame = image1->depth;
  EXPECT_EQ(frame.intrinsics.fx, 481.2f);
  EXPECT_EQ(frame.intrinsics.fy, 480.0f);
  EXPECT_EQ(frame.intrinsics.cy, 239.5f);
  for (const int v : {0, 100, 239, 479}) {
    const double z = 2.0 * (v + 1) / 5000.0;  // image 1, before flipping
    const Eigen::Vector3d p_W((10 - 319.5) * z / 481.2, (v - 239.5) * z / -480.0, z - 2.25);
    EXPECT_TRUE(pointOf(frame, 10, 479 - v).isApprox(p_W, 1e-5)) << v;
  }
}

// Flipping the rows also moves an off-centre principal point.
TEST_F(IclArchive, PrincipalPointIsFlippedToo) {
  options_.intrinsics = Intrinsics{481.2f, -480.0f, 319.5f, 200.0f};
  EXPECT_EQ(openRecording(options_)->next()->depth.intrinsics.cy, 279.0f);
  options_.intrinsics = Intrinsics{481.2f, 480.0f, 319.5f, 200.0f};
  EXPECT_EQ(rawAt(openRecording(options_)->next()->depth, 0, 0), 2);  // not flipped
}

TEST_F(IclArchive, ColourCanBeListedFirst) {
  writeBytes(folder_ / "associations.txt", "1 rgb/1.png 1 depth/1.png\n");
  EXPECT_EQ(readAll(*openRecording(options_)).size(), 1u);
}

TEST_F(IclArchive, ReportsInvalidFiles) {
  const std::string list = folder_ / "associations.txt";
  for (const char* line : {"0", "0 depth/0.png", "x depth/0.png 0 rgb/0.png",
                           "0 depths/0.png 0 rgb/0.png", "0 depth/0.png 0 rgb/0.png 1"}) {
    expectError("associations.txt", std::string("# c\n") + line, list + ":2: ");
  }
  expectError("associations.txt", "", "lists no depth image");
  expectError("associations.txt", "1 depth/9.png 1 rgb/9.png", "depth/9.png");
  expectError("livingRoom0.gt.freiburg", "1 0 0 -2.25 0 0 0 3", "livingRoom0.gt.freiburg:1: ");
  expectError("livingRoom0.gt.freiburg", "", "none of the 3 depth images has a pose");
  expectError("livingRoom1.gt.freiburg", "1 0 0 0 0 0 0 1", "contains 2 *.gt.freiburg files");
  std::filesystem::remove(folder_ / "livingRoom1.gt.freiburg");
  std::filesystem::remove(folder_ / "livingRoom0.gt.freiburg");
  EXPECT_NE(readingErrorOf(options_).find("contains 0 *.gt.freiburg files"), std::string::npos);
}

// Colour images come from the same camera, so they are flipped too.
TEST_F(IclArchive, ColourIsFlippedLikeDepth) {
  for (const int i : {0, 1, 2}) {
    writeColourRows(folder_ / ("rgb/" + std::to_string(i) + ".png"), 640, 480, 0);
  }
  cv::Mat marked(480, 640, CV_8UC3, cv::Scalar(0, 0, 0));
  marked.row(479).setTo(cv::Scalar(0, 0, 99));
  cv::imwrite(folder_ / "rgb/1.png", marked);
  const std::vector<SourceColour> images = readAllColours(options_);
  ASSERT_EQ(images.size(), 2u);  // image 0 has no pose
  EXPECT_EQ(images[0].stamp_s, 1.0);
  EXPECT_EQ(redAt(images[0].colour, 0), 99);
  EXPECT_EQ(redAt(images[0].colour, 479), 0);
  EXPECT_EQ(images[0].colour.intrinsics.fy, 480.0f);
  EXPECT_EQ(images[0].colour.intrinsics.cy, 239.5f);
  EXPECT_EQ(images[1].colour.T_W_C.translation().y(), 0.00895357);
}

}  // namespace
}  // namespace dtsdf
