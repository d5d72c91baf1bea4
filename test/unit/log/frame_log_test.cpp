// What is logged is read as it was, as far as it was written; what is not is cut off, and counted.
#include "log/frame_log.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>

#include "log/log_queue.h"
#include "log/log_reader.h"
#include "log/record_codes.h"
#include "support/logged_map.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

LogBegin someBegin() {
  LogBegin begin;
  begin.settings = settingsOf(makeCpuParams());
  begin.map_frame = "odom of 'somewhere'";
  begin.stamp_s = 1234.5;
  return begin;
}

Eigen::Isometry3d somePose(double s) {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(0.3 + s, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation() = Eigen::Vector3d(0.1 + s, -7.0 / 3.0, 1e-9);
  return pose;
}

DepthFrame depthOf(const void* pixels, DepthEncoding encoding, size_t row_bytes) {
  DepthFrame frame;
  frame.data = pixels;
  frame.row_bytes = row_bytes;
  frame.width = 5;
  frame.height = 3;
  frame.encoding = encoding;
  frame.unit_m = 0.00025f;
  frame.intrinsics = {501.25f, 499.75f, 2.5f, 1.25f};
  frame.T_W_C = somePose(0.0);
  return frame;
}

/// Bit for bit, since depth may be NaN.
template <class T>
bool sameBytes(const T* a, const T* b, size_t count) {
  return std::memcmp(a, b, count * sizeof(T)) == 0;
}

TEST(ImageCodes, KeepWholeDepthOfEveryValue) {
  std::vector<uint16_t> pixels;
  for (int i = 0; i < 65536; ++i) pixels.push_back(static_cast<uint16_t>(i));
  for (uint32_t i = 0; i < 65536; ++i) pixels.push_back(static_cast<uint16_t>(40503u * i));
  for (int i = 0; i < 4096; ++i) pixels.push_back(i % 2 == 0 ? 0 : 65535);
  const std::string code = packDepth16(pixels.data(), pixels.size());
  EXPECT_EQ(unpackDepth16(code, pixels.size()), pixels);
  EXPECT_ANY_THROW(unpackDepth16(code.substr(0, code.size() / 2), pixels.size()));
}

TEST(ImageCodes, KeepTheBitsOfFloats) {
  SCOPED_TRACE(describeSeed(caseSeed(1)));
  std::mt19937 random(caseSeed(1));
  std::vector<float> values = {0.0f, -0.0f, std::numeric_limits<float>::quiet_NaN(),
                               std::numeric_limits<float>::infinity(), 1e-42f};
  while (values.size() < 5000) {
    const auto bits = static_cast<uint32_t>(random());
    float value;
    std::memcpy(&value, &bits, sizeof(value));
    values.push_back(value);
  }
  const std::string code = packFloats(values.data(), values.size());
  const std::vector<float> back = unpackFloats(code, values.size());
  EXPECT_TRUE(sameBytes(back.data(), values.data(), values.size()));
  EXPECT_ANY_THROW(unpackFloats(code, values.size() + 1));
}

TEST(FrameLog, DepthComesBackBitForBit) {
  // Rows are apart, as a driver may have them; what lies between is no part of the image.
  std::vector<uint16_t> pixels(3 * 8);
  for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<uint16_t>(65535 - 977 * i);
  DepthFrame frame = depthOf(pixels.data(), DepthEncoding::kUint16, 16);
  frame.keep_center_W = Eigen::Vector3d(0.1, 0.2, 1.0 / 3.0);
  const LoggedDepth back = readDepth(toRecord(frame, 17.125, 3));
  EXPECT_EQ(back.image.stamp_s, 17.125);
  EXPECT_EQ(back.image.camera, 3u);
  EXPECT_EQ(back.frame.T_W_C.matrix(), frame.T_W_C.matrix());
  EXPECT_EQ(back.frame.unit_m, frame.unit_m);
  EXPECT_EQ(back.frame.intrinsics.fy, frame.intrinsics.fy);
  EXPECT_EQ(back.frame.intrinsics.cx, frame.intrinsics.cx);
  ASSERT_TRUE(back.frame.keep_center_W);
  EXPECT_EQ(*back.frame.keep_center_W, *frame.keep_center_W);
  ASSERT_EQ(back.integers.size(), 15u);
  for (size_t v = 0; v < 3; ++v) {
    EXPECT_TRUE(sameBytes(back.integers.data() + 5 * v, pixels.data() + 8 * v, 5));
  }
}

TEST(FrameLog, FloatsAndColoursComeBackBitForBit) {
  std::vector<float> depth(15, 1.5f);
  depth[3] = std::numeric_limits<float>::quiet_NaN();
  const LoggedDepth floats =
      readDepth(toRecord(depthOf(depth.data(), DepthEncoding::kFloat32, 20), 1.0, 0));
  EXPECT_TRUE(sameBytes(floats.floats.data(), depth.data(), 15));
  EXPECT_FALSE(floats.frame.keep_center_W);

  for (const ColourEncoding encoding :
       {ColourEncoding::kRgb8, ColourEncoding::kBgra8, ColourEncoding::kMono8}) {
    const size_t bytes = encoding == ColourEncoding::kRgb8    ? 3
                         : encoding == ColourEncoding::kMono8 ? 1
                                                              : 4;
    std::vector<uint8_t> pixels(15 * bytes);
    for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<uint8_t>(71 * i);
    ColourFrame frame;
    frame.data = pixels.data();
    frame.row_bytes = 5 * bytes;
    frame.width = 5;
    frame.height = 3;
    frame.encoding = encoding;
    frame.T_W_C = somePose(0.5);
    const LoggedColour colour = readColour(toRecord(frame, 2.0, 1));
    EXPECT_EQ(colour.bytes, pixels);
    EXPECT_EQ(colour.frame.encoding, encoding);
    EXPECT_EQ(colour.frame.T_W_C.matrix(), frame.T_W_C.matrix());
    EXPECT_EQ(colour.image.camera, 1u);
  }
}

/// Those of the mapper are apart: it refuses settings that are not its own.
TEST(FrameLog, SaysHowPosesWereFound) {
  LogBegin begin = someBegin();
  const std::string as_given = toRecord(begin).description;
  EXPECT_EQ(as_given.find("poses/"), std::string::npos);
  begin.poses.mode = PoseMode::kRefine;
  begin.poses.sigma_m = 0.02;
  const LogBegin back = readBegin(toRecord(begin).description);
  EXPECT_EQ(back.poses.mode, PoseMode::kRefine);
  EXPECT_EQ(back.poses.sigma_m, 0.02);
  EXPECT_EQ(back.settings, begin.settings);
  EXPECT_NO_THROW(readMapperParams(back.settings));
}

TEST(FrameLog, CallsAndSettingsComeBack) {
  const BoxRegion box{somePose(1.0), {1.0, 2.0, 1.0 / 3.0}};
  const auto box_back = std::get<BoxRegion>(readRegion(toRecord(Region(box)).description));
  EXPECT_EQ(box_back.T_W_B.matrix(), box.T_W_B.matrix());
  EXPECT_EQ(box_back.size_m, box.size_m);
  const SphereRegion ball{{1.0, 2.0, 3.0}, 0.7};
  EXPECT_EQ(std::get<SphereRegion>(readRegion(toRecord(Region(ball)).description)).radius_m, 0.7);

  const LogBegin begin = someBegin(), begin_back = readBegin(toRecord(begin).description);
  EXPECT_EQ(begin_back.settings, begin.settings);
  EXPECT_EQ(begin_back.map_frame, begin.map_frame);
  EXPECT_EQ(begin_back.stamp_s, begin.stamp_s);
  EXPECT_EQ(begin_back.poses.mode, PoseMode::kTf);
  EXPECT_EQ(readLevel(levelRecord(somePose(0.2)).description).matrix(), somePose(0.2).matrix());

  const LogCorrection correction{7, 2, {{1.0, somePose(0.0)}, {2.0, somePose(0.1)}}};
  const LogCorrection back = readCorrection(toRecord(correction).description);
  EXPECT_EQ(back.before, 7u);
  EXPECT_EQ(back.first_moved, 2u);
  ASSERT_EQ(back.poses.size(), 2u);
  EXPECT_EQ(back.poses[1].T_W_C.matrix(), somePose(0.1).matrix());
  EXPECT_ANY_THROW(readRegion(toRecord(begin).description));
}

/// A log with three images in segments of their own, and its only stretch.
class SmallLog : public testing::Test {
 protected:
  SmallLog() {
    FrameLog log(logOptions(folder_.path(), 1u << 20, 1));
    log.begin(someBegin(), nullptr);
    for (int i = 0; i < 3; ++i) log.add(image(i), i);
  }
  static LogRecord image(int i) {
    const std::vector<uint16_t> pixels(15, static_cast<uint16_t>(1000 + i));
    return toRecord(depthOf(pixels.data(), DepthEncoding::kUint16, 10), i, 0);
  }
  std::string lastSegment() const { return segmentsIn(stretchesIn(folder_.path())[0].path).back(); }
  /// Stamps of the images that can be read.
  std::vector<double> stamps(std::string* cut_off = nullptr) const {
    LogReader reader(folder_.path());
    std::vector<double> stamps;
    while (const auto entry = reader.next()) {
      stamps.push_back(readDepth(readRecord(*entry)).image.stamp_s);
    }
    if (cut_off != nullptr) *cut_off = reader.cutOff();
    return stamps;
  }
  TemporaryFolder folder_;
};

TEST_F(SmallLog, IsReadAsItWasWritten) {
  std::string cut_off;
  EXPECT_EQ(stamps(&cut_off), (std::vector<double>{0.0, 1.0, 2.0}));
  EXPECT_EQ(cut_off, "");
}

// A process that is killed has written its last record in part.
TEST_F(SmallLog, ATornTailIsCutOffWhereverItIsTorn) {
  const std::string whole = readBytes(lastSegment());
  for (size_t bytes = 0; bytes < whole.size(); ++bytes) {
    writeBytes(lastSegment(), whole.substr(0, bytes));
    std::string cut_off;
    EXPECT_EQ(stamps(&cut_off), (std::vector<double>{0.0, 1.0})) << bytes;
    EXPECT_EQ(cut_off.empty(), bytes == 0) << cut_off;
  }
}

TEST_F(SmallLog, AChangedByteEndsTheLogOrIsAnError) {
  const std::string whole = readBytes(lastSegment());
  for (size_t i = 0; i < whole.size(); ++i) {
    if (i >= 20 && i < 24) continue;  // for later versions
    std::string bytes = whole;
    bytes[i] = static_cast<char>(bytes[i] ^ 0x10);
    writeBytes(lastSegment(), bytes);
    bool is_found = false;
    try {
      is_found = stamps() == std::vector<double>{0.0, 1.0};
    } catch (const std::runtime_error& error) {
      is_found = std::string(error.what()).find("damaged") != std::string::npos;
    }
    EXPECT_TRUE(is_found) << i;
  }
}

TEST_F(SmallLog, ASecondWriterIsRefused) {
  FrameLog log(logOptions(folder_.path()));
  EXPECT_NE(errorOf([&] { FrameLog second(logOptions(folder_.path())); }).find("another process"),
            std::string::npos);
}

TEST_F(SmallLog, ALaterRunGoesOnBesideIt) {
  {
    FrameLog log(logOptions(folder_.path()));
    log.begin(someBegin(), nullptr);
    EXPECT_EQ(stamps().size(), 3u);  // as long as the new one has nothing
    log.add(image(9), 9.0);
  }
  EXPECT_EQ(stamps(), (std::vector<double>{9.0}));
  fs::remove_all(stretchesIn(folder_.path())[1].path);
  EXPECT_EQ(stamps().size(), 3u);
}

TEST_F(SmallLog, IsReadWhileItIsWritten) {
  FrameLog log(logOptions(folder_.path(), 1u << 20, 1));
  log.begin(someBegin(), nullptr);
  log.add(image(5), 5.0);
  LogReader reader(folder_.path());
  EXPECT_TRUE(reader.next());
  for (int i = 6; i < 9; ++i) {
    EXPECT_FALSE(reader.next());
    log.add(image(i), i);
    const auto entry = reader.next();
    ASSERT_TRUE(entry);
    EXPECT_EQ(readDepth(readRecord(*entry)).image.stamp_s, i);
  }
}

TEST(FrameLogBound, OldestGoesFirst) {
  const TemporaryFolder folder;
  MapperParams params = makeCpuParams();
  params.map.voxel_size_m = 0.2f;
  const std::vector<SceneFrame> frames = roomImages(3);
  constexpr uint64_t kMost = 1u << 20;
  FrameLog log(logOptions(folder.path(), kMost, 1u << 14));
  LoggedMap live(params, log);
  int fused = 0;
  for (; fused < 400 && log.firstStamp_s().value_or(0.0) == 0.0; ++fused) {
    live.fuse(frames[static_cast<size_t>(fused) % 3], fused);
    if (log.wantsMap()) live.checkpoint();
    ASSERT_LE(log.bytes(), kMost);
  }
  ASSERT_LT(fused, 400);
  EXPECT_GT(*log.firstStamp_s(), 0.0);
  uint64_t on_disk = 0;
  for (const LogStretchFolder& stretch : stretchesIn(folder.path()))
    on_disk += bytesIn(stretch.path);
  EXPECT_EQ(on_disk, log.bytes());
  LogReader reader(folder.path());
  EXPECT_TRUE(reader.hasLostImages());
  const auto first = reader.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(readImage(first->head.kind, first->description).stamp_s, log.firstStamp_s());
}

/// A disk with so much room.
LogWrite diskWith(uint64_t* left) {
  return [left](int descriptor, const void* data, size_t bytes) -> ssize_t {
    if (*left == 0) {
      errno = ENOSPC;
      return -1;
    }
    const ssize_t written = ::write(descriptor, data, std::min<size_t>(bytes, *left));
    *left -= static_cast<uint64_t>(written);
    return written;
  };
}

TEST(LogQueue, AFullDiskIsCountedAndTheLogBeginsAnewOnceThereIsRoom) {
  const TemporaryFolder folder;
  const SceneFrame frame = roomImages(1)[0];
  const auto pixels = std::make_shared<std::vector<float>>(frame.depth_m);
  uint64_t left = 20000;
  FrameLog::Options options = logOptions(folder.path());
  options.write = diskWith(&left);
  LogQueue queue({options, 1u << 30, std::chrono::seconds(0)});
  EXPECT_TRUE(queue.wantsMap());
  queue.begin(someBegin(), nullptr);
  const auto written = [&] { return queue.mark().get(); };
  const uint64_t life = written()->life;
  while (written()) queue.add(frame.view(), 1.0, 0, pixels);
  EXPECT_GE(queue.report().lost, 1u);
  EXPECT_NE(queue.report().problem.find("No space"), std::string::npos) << queue.report().problem;
  EXPECT_FALSE(queue.report().first_stamp_s);
  const uint64_t lost = queue.report().lost;
  queue.add(frame.view(), 2.0, 0, pixels);
  EXPECT_EQ(queue.report().lost, lost + 1);

  left = 1u << 30;
  EXPECT_TRUE(queue.wantsMap());
  LogBegin again = someBegin();
  again.continues = again.stands_for_lost = true;  // which it does not, as images are missing
  queue.begin(again, nullptr);
  queue.add(frame.view(), 3.0, 0, pixels);
  ASSERT_TRUE(written());
  EXPECT_EQ(written()->life, life + 1) << "its numbers are others";
  EXPECT_EQ(written()->number, 2u);
  EXPECT_EQ(queue.report().problem, "");
  EXPECT_EQ(queue.report().first_stamp_s, 3.0);
  LogReader reader(folder.path());
  EXPECT_TRUE(reader.hasLostImages());
  EXPECT_TRUE(reader.next());
  EXPECT_FALSE(reader.next());
}

TEST(LogQueue, CanBeCorrectedFromTheFirstCamerasFirstDepthImageOn) {
  const TemporaryFolder folder;
  const SceneFrame frame = roomImages(1)[0];
  const auto pixels = std::make_shared<std::vector<float>>(frame.depth_m);
  LogQueue queue({logOptions(folder.path()), 1u << 30, std::chrono::seconds(0)});
  queue.begin(someBegin(), nullptr);
  queue.add(frame.view(), 1.0, 1, pixels);
  ASSERT_TRUE(queue.mark().get());
  EXPECT_FALSE(queue.report().first_stamp_s);
  queue.add(frame.view(), 2.0, 0, pixels);
  ASSERT_TRUE(queue.mark().get());
  EXPECT_EQ(queue.report().first_stamp_s, 2.0);
}

TEST(LogQueue, WhatTheDiskIsTooSlowForIsCounted) {
  const TemporaryFolder folder;
  const SceneFrame frame = roomImages(1)[0];
  const auto pixels = std::make_shared<std::vector<float>>(frame.depth_m);
  LogQueue queue({logOptions(folder.path()), 1000, std::chrono::seconds(0)});
  queue.begin(someBegin(), nullptr);
  ASSERT_TRUE(queue.mark().get());
  queue.add(frame.view(), 1.0, 0, pixels);
  EXPECT_EQ(queue.report().lost, 1u);
  EXPECT_FALSE(queue.mark().get());
  EXPECT_TRUE(queue.wantsMap());
}

}  // namespace
}  // namespace dtsdf
