/// Tests reading the colour images of recordings. Folder layouts are tested in formats/.
#include <gtest/gtest.h>

#include "dtsdf_mapping/io/rate_limit.h"
#include "dtsdf_mapping/io/recording.h"
#include "io/colour_codes.h"
#include "support/tum_folder.h"

namespace dtsdf {
namespace {

class RecordedColoursTest : public testing::Test {
 protected:
  void SetUp() override {
    writeTumFolder(folder_, 3);
    std::filesystem::create_directories(folder_ / "rgb");
    // OpenCV stores blue first. The list is not sorted by stamp, and its last image has no pose.
    cv::imwrite(folder_ / "rgb/a.png", cv::Mat(kTumHeight, kTumWidth, CV_8UC3, {10, 20, 30}));
    cv::imwrite(folder_ / "rgb/b.jpg", cv::Mat(kTumHeight, kTumWidth, CV_8UC3, {200, 100, 50}));
    writeBytes(folder_ / "rgb.txt",
               "# stamp file\n100.15 rgb/b.jpg\n100.01 rgb/a.png\n200.0 rgb/a.png\n");
    options_.path = folder_.path();
    options_.pose_tolerance_s = 0.06;
  }

  std::string error() const {
    return errorOf([&] {
      const auto source = openRecordingColours(options_);
      while (source->next()) {
      }
    });
  }

  TemporaryFolder folder_;
  RecordingOptions options_;
};

TEST_F(RecordedColoursTest, ReadsImagesInStampOrderWithOwnPoses) {
  const auto source = openRecordingColours(options_);
  ASSERT_NE(source, nullptr);
  const auto first = source->next();
  ASSERT_TRUE(first);
  EXPECT_DOUBLE_EQ(first->stamp_s, 100.01);
  EXPECT_NEAR(first->colour.T_W_C.translation().x(), 0.1, 1e-6);
  EXPECT_EQ(first->colour.width, kTumWidth);
  EXPECT_EQ(first->colour.height, kTumHeight);
  EXPECT_EQ(first->colour.intrinsics.fy, 11.0f);
  const auto* pixels = static_cast<const uint8_t*>(first->colour.data);
  EXPECT_EQ(std::vector<int>(pixels + 3, pixels + 6), (std::vector<int>{30, 20, 10}));
  const auto second = source->next();
  ASSERT_TRUE(second);
  EXPECT_DOUBLE_EQ(second->stamp_s, 100.15);
  const auto* jpeg = static_cast<const uint8_t*>(second->colour.data);
  EXPECT_NEAR(jpeg[0], 50, 3);
  EXPECT_NEAR(jpeg[2], 200, 3);
  EXPECT_FALSE(source->next());
  EXPECT_EQ(source->skipped().at("colour images: no pose within 60 ms"), 1u);
}

TEST_F(RecordedColoursTest, ReadsOnlyTheListedImages) {
  std::vector<std::vector<size_t>> indices;
  for (const std::vector<size_t>& listed : {std::vector<size_t>{0, 1, 2}, {1}, {0, 2}, {}}) {
    options_.listed_colours = std::make_shared<const std::vector<size_t>>(listed);
    const auto source = openRecordingColours(options_);
    indices.emplace_back();
    while (const auto image = source->next()) {
      EXPECT_DOUBLE_EQ(image->stamp_s, image->index == 0 ? 100.01 : 100.15);
      indices.back().push_back(image->index);
    }
  }
  EXPECT_EQ(indices, (std::vector<std::vector<size_t>>{{0, 1}, {1}, {0}, {}}));
}

TEST_F(RecordedColoursTest, ImagesCanHaveTheirOwnCamera) {
  cv::imwrite(folder_ / "rgb/a.png", cv::Mat(9, 12, CV_8UC3, {1, 2, 3}));
  cv::imwrite(folder_ / "rgb/b.jpg", cv::Mat(9, 12, CV_8UC3, {1, 2, 3}));
  const auto source = openRecordingColours(options_);
  EXPECT_FALSE(source->next());
  EXPECT_EQ(source->skipped().at("colour images: 12 x 9 pixels, but their camera has 8 x 6"), 2u);
  writeBytes(folder_ / "colour_info.yaml",
             "image_width: 12\nimage_height: 9\n"
             "projection_matrix:\n  data: [20, 0, 6, 0, 0, 21, 4, 0, 0, 0, 1, 0]\n");
  EXPECT_EQ(error(), "");
  EXPECT_EQ(openRecordingColours(options_)->next()->colour.intrinsics.fx, 20.0f);
}

TEST_F(RecordedColoursTest, DamagedFilesAreErrorsMissingOnesAreCounted) {
  writeBytes(folder_ / "rgb/a.png", "no picture");
  EXPECT_NE(error().find("rgb/a.png"), std::string::npos) << error();
  EXPECT_NE(error().find("colour/enabled"), std::string::npos) << error();
  std::filesystem::remove(folder_ / "rgb/a.png");
  const auto source = openRecordingColours(options_);
  EXPECT_DOUBLE_EQ(source->next()->stamp_s, 100.15);
  EXPECT_EQ(source->skipped().at("colour images: no such file"), 1u);
}

/// PNG and JPEG images whose pixels are not 8-bit RGB are converted to 8-bit RGB.
TEST_F(RecordedColoursTest, OtherPixelTypesBecomeRgb) {
  const auto first = [&](const std::string& name, const cv::Mat& image) {
    cv::imwrite(folder_ / name, image);
    const RgbImage file = readColourImage(folder_ / name);
    EXPECT_EQ(file.width, image.cols);
    EXPECT_EQ(file.values.size(), 3 * image.total());
    return std::vector<int>(file.values.begin(), file.values.begin() + 3);
  };
  EXPECT_EQ(first("grey.png", cv::Mat(4, 5, CV_8UC1, {77})), (std::vector<int>{77, 77, 77}));
  EXPECT_EQ(first("grey.jpg", cv::Mat(4, 5, CV_8UC1, {77})), (std::vector<int>{77, 77, 77}));
  EXPECT_EQ(first("deep.png", cv::Mat(4, 5, CV_16UC3, {0, 257 * 20, 257 * 200})),
            (std::vector<int>{200, 20, 0}));
  EXPECT_EQ(first("clear.png", cv::Mat(4, 5, CV_8UC4, {1, 2, 3, 4})), (std::vector<int>{3, 2, 1}));
}

/// Some versions of libpng write out of bounds when they decode interlaced 16-bit images.
TEST_F(RecordedColoursTest, Interlaced16BitImagesAreRefused) {
  const std::string head(
      "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\2\0\0\0\2\x10\2\0\0\1\332\103\166\246\0\0\0\0IDAT", 41);
  const std::string error =
      errorOf([&] { decodeColour(reinterpret_cast<const uint8_t*>(head.data()), 41, "it"); });
  EXPECT_NE(error.find("without interlacing"), std::string::npos) << error;
}

/// TurboJPEG supports only common chroma subsampling schemes.
TEST_F(RecordedColoursTest, UnsupportedSubsamplingIsReported) {
  std::string file = readBytes(folder_ / "rgb/b.jpg");
  const size_t frame = file.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  file[frame + 11] = 0x31;  // 3 x 1 luma samples per chroma sample
  writeBytes(folder_ / "rgb/b.jpg", file);
  EXPECT_NE(error().find("subsampling"), std::string::npos) << error();
}

/// Files truncated at any point must be refused.
TEST_F(RecordedColoursTest, TruncatedFilesAreErrors) {
  for (const std::string name : {"rgb/a.png", "rgb/b.jpg"}) {
    cv::Mat image(40, 60, CV_8UC3);
    cv::randu(image, 0, 255);
    cv::imwrite(folder_ / name, image);
    const std::string whole = readBytes(folder_ / name);
    for (const double share : {0.0, 0.001, 0.01, 0.3, 0.9}) {
      writeBytes(folder_ / name,
                 whole.substr(0, static_cast<size_t>(share * static_cast<double>(whole.size()))));
      EXPECT_THROW(readColourImage(folder_ / name), std::runtime_error) << name << " " << share;
    }
  }
}

std::vector<int> taken(double rate_hz, double max_rate_hz, int images) {
  RateLimit limit(max_rate_hz);
  std::vector<int> taken;
  for (int i = 0; i < images; ++i) {
    if (limit.takes(100.0 + i / rate_hz)) taken.push_back(i);
  }
  return taken;
}

TEST(RateLimit, ThinsOutARegularStream) {
  EXPECT_EQ(taken(30.0, 0.0, 4), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(taken(30.0, 60.0, 4), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(taken(30.0, 30.0, 4), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(taken(30.0, 15.0, 5), (std::vector<int>{0, 2, 4}));
  EXPECT_EQ(taken(30.0, 20.0, 300).size(), 200u);
}

TEST(RateLimit, RestartsAfterGapsAndJumps) {
  RateLimit limit(10.0);
  EXPECT_TRUE(limit.takes(100.0));
  EXPECT_FALSE(limit.takes(100.05));
  EXPECT_TRUE(limit.takes(107.0));
  EXPECT_FALSE(limit.takes(107.05)) << "only one image should be accepted right after a gap";
  EXPECT_TRUE(limit.takes(5.0)) << "the first image after a bag loops should be accepted";
  EXPECT_FALSE(limit.takes(5.05));
}

}  // namespace
}  // namespace dtsdf
