// Tests that a journal restores the recorded map, and stays readable after a crash or on a full
// disk.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <thread>

#include "support/journaled_map.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

class Journal : public testing::Test {
 protected:
  static constexpr int kCount = 8;

  Journal() : images_(roomImages(kCount)) {}

  const SceneFrame& image(int i) const { return images_[static_cast<size_t>(i)]; }

  /// Records all depth images, one colour image and a cleared region. @return The saved map.
  std::string write(JournalWriter& journal) {
    JournaledMap map(journaledParams(), journal);
    for (int i = 0; i < kCount; ++i) {
      map.fuse(image(i), 0.1 * i);
      if (i == 4)
        map.paint(renderColour(makeRoomScene(), wavesAt, image(i).frame.T_W_C, 80, 60), 0.4);
      if (i == 5) map.clearRegion(SphereRegion{Eigen::Vector3d(1.0, 0.5, 0.5), 0.8});
    }
    EXPECT_TRUE(journal.written().get());
    return fileOf(map.mapper());
  }

  TemporaryFolder folder_;
  const std::vector<SceneFrame> images_;
};

TEST_F(Journal, RestoresTheMap) {
  JournalWriter journal(journalOptions(folder_.path()));
  const std::string map = write(journal);
  EXPECT_TRUE(mapOf(journal.path(), journaledParams()) == map);
  JournalReplay replay(journal.path());
  EXPECT_EQ(replay.depthImages(), size_t{kCount});
  EXPECT_EQ(replay.count(), journal.count());
  EXPECT_EQ(replay.begin().map_frame, "map");
  EXPECT_EQ(replay.incompleteEnd(), "");
  EXPECT_EQ(journal.report().problem, "");
  EXPECT_EQ(journal.report().bytes, fs::file_size(journal.path()));
  EXPECT_TRUE(isJournal(journal.path()));
}

TEST_F(Journal, ContainsTheLoadedMap) {
  JournalWriter journal(journalOptions(folder_ / "journals"));
  JournaledMap map(journaledParams(), journal);
  map.fuse(image(0), 0.0);
  saveMap(map.mapper().contents(), folder_ / "map.dtsdf");
  map.load(folder_ / "map.dtsdf");
  map.fuse(image(3), 0.3);
  ASSERT_TRUE(journal.written().get());
  fs::remove(folder_ / "map.dtsdf");  // the journal contains the map
  EXPECT_TRUE(mapOf(journal.path(), journaledParams()) == fileOf(map.mapper()));
  map.clear();
  map.fuse(image(5), 0.5);
  ASSERT_TRUE(journal.written().get());
  EXPECT_TRUE(mapOf(journal.path(), journaledParams()) == fileOf(map.mapper()));
}

TEST_F(Journal, KeepsEveryBitOfAnImage) {
  JournalWriter journal(journalOptions(folder_.path()));
  journal.begin({settingsOf(journaledParams()), {}, "map", "map", false});
  std::vector<uint16_t> whole{0, 1, 65535, 400, 400, 7};
  std::vector<float> parts{0.0f, -1.5f, 3e8f, std::nanf(""), 1.25f, 1e-30f};
  DepthFrame frame;
  frame.width = 2;
  frame.height = 2;
  frame.intrinsics = {1.0f, 2.0f, 3.0f, 4.0f};
  frame.keep_center_W = Eigen::Vector3d(1.0, 2.0, 3.0);
  frame.data = whole.data();
  frame.row_bytes = 6;  // each row is padded by one pixel
  journal.add(journal::Image{0.0, 2, frame.T_W_C, frame, nullptr});
  frame.encoding = DepthEncoding::kFloat32;
  frame.data = parts.data();
  frame.row_bytes = 12;
  journal.add(journal::Image{0.0, 2, frame.T_W_C, frame, nullptr});
  ASSERT_TRUE(journal.written().get());
  JournalReplay replay(journal.path());
  const auto first = replay.next(), second = replay.next();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(std::get<journal::Image>(*first).camera, 2u);
  const auto depthOf = [](const journal::Call& call) {
    return std::get<DepthFrame>(std::get<journal::Image>(call).frame);
  };
  EXPECT_EQ(depthOf(*first).keep_center_W, frame.keep_center_W);
  const auto* const read = static_cast<const char*>(depthOf(*first).data);
  EXPECT_EQ(std::memcmp(read, whole.data(), 4), 0);
  EXPECT_EQ(std::memcmp(read + 4, &whole[3], 4), 0);
  const auto* const floats = static_cast<const char*>(depthOf(*second).data);
  EXPECT_EQ(std::memcmp(floats, parts.data(), 8), 0);
  EXPECT_EQ(std::memcmp(floats + 8, &parts[3], 8), 0);
}

/// A journal may end at any byte, for example after kill -9.
TEST_F(Journal, IsReadableWhereverItIsCutOff) {
  std::string path;
  {
    JournalWriter journal(journalOptions(folder_.path()));
    write(journal);
    path = journal.path();
  }
  const std::string bytes = readBytes(path);
  size_t fewest = kCount, most = 0;
  for (size_t length = bytes.size() / 4; length < bytes.size(); length += bytes.size() / 40) {
    writeBytes(path, bytes.substr(0, length));
    JournalReplay replay(path);
    EXPECT_TRUE(contains(replay.incompleteEnd(), "ignored")) << length;
    size_t calls = 0;
    while (replay.next()) ++calls;
    fewest = std::min(fewest, replay.depthImages());
    most = std::max(most, replay.depthImages());
  }
  EXPECT_LT(fewest, most);
  writeBytes(path, bytes.substr(0, bytes.size() - 100) + std::string(100, '\0'));
  EXPECT_NE(JournalReplay(path).incompleteEnd(), "");
  std::string damaged = bytes;
  damaged[bytes.size() / 2] = static_cast<char>(damaged[bytes.size() / 2] ^ 4);
  writeBytes(path, damaged);
  EXPECT_NE(errorOf([&] { mapOf(path, journaledParams()); }), "");
}

TEST_F(Journal, ReportsWhenAFullDiskStoppedIt) {
  for (const int error : {ENOSPC, 0}) {
    std::atomic<int> left{200000};
    JournalWriter::Options options = journalOptions(folder_.path());
    options.write = [&](int descriptor, const void* data, size_t bytes) -> ssize_t {
      const auto some = std::min<size_t>(bytes, static_cast<size_t>(std::max(left.load(), 0)));
      errno = error;
      if (some == 0) return error == 0 ? 0 : -1;
      left -= static_cast<int>(some);
      return ::write(descriptor, data, some);
    };
    JournalWriter journal(options);
    JournaledMap map(journaledParams(), journal);
    for (int i = 0; i < kCount; ++i) {
      map.fuse(image(i), 0.1 * i);
      if (!journal.written().get()) break;
      left -= 40000;
    }
    const JournalReport report = journal.report();
    EXPECT_TRUE(contains(report.problem, "nothing has been written since 20")) << report.problem;
    EXPECT_TRUE(contains(report.problem, "call clear_map")) << report.problem;
    EXPECT_NE(JournalReplay(journal.path()).count(), 0u);
    left = 1 << 30;
    map.clear();  // starts a new recording
    map.fuse(image(2), 5.0);
    EXPECT_TRUE(journal.written().get());
    EXPECT_EQ(journal.report().problem, "");
    EXPECT_TRUE(mapOf(journal.path(), journaledParams()) == fileOf(map.mapper()));
  }
}

TEST_F(Journal, ReportsAFailedSync) {
  std::atomic<bool> fails{true};
  JournalWriter::Options options = journalOptions(folder_.path());
  options.sync = [&](int) {
    errno = EIO;
    return fails ? -1 : 0;
  };
  JournalWriter journal(options);
  JournaledMap map(journaledParams(), journal);
  for (int i = 0; i < 10000 && journal.report().problem.empty(); ++i) {
    map.clearRegion(SphereRegion{Eigen::Vector3d::Zero(), 0.1});
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(contains(journal.report().problem, "Input/output error")) << journal.report().problem;
  EXPECT_FALSE(journal.written().get());
  fails = false;
  map.clear();
  EXPECT_TRUE(journal.written().get()) << "a new map should be recorded in a new file";
}

TEST_F(Journal, LeavesNoFileIfItCannotBegin) {
  JournalWriter::Options options = journalOptions(folder_.path());
  options.write = [](int, const void*, size_t) -> ssize_t {
    errno = ENOSPC;
    return -1;
  };
  EXPECT_TRUE(contains(errorOf([&] { JournalWriter journal(options); }), "No space left"));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

/// The writer does not touch other files, and only journals count towards journal/max_gb.
TEST_F(Journal, LeavesAllOtherFilesAlone) {
  const std::string folder = folder_ / "journals", outside = folder_ / "outside";
  fs::create_directories(folder + "/000001");
  fs::create_directories(outside);
  writeBytes(outside + "/thesis.txt", std::string(5000, 't'));
  writeBytes(folder + "/000001/mine", "mine");
  writeBytes(folder + "/notes.dtsdfj", std::string(100000, 'n'));
  fs::create_symlink(outside, folder + "/000002");
  fs::create_symlink(outside + "/thesis.txt", folder + "/000003.dtsdfj");
  ASSERT_EQ(mkfifo((folder + "/pipe.dtsdfj").c_str(), 0600), 0);
  JournalWriter::Options options = journalOptions(folder);
  options.max_bytes = 60000;
  for (int run = 0; run < 3; ++run) {
    JournalWriter journal(options);
    JournaledMap map(journaledParams(), journal);
    for (int i = 0; i < kCount; ++i) map.fuse(image(i), 0.1 * i);
    journal.written().get();
    EXPECT_TRUE(contains(journal.report().problem, "journal/max_gb")) << run;
  }
  EXPECT_EQ(readBytes(outside + "/thesis.txt").size(), 5000u);
  EXPECT_EQ(readBytes(folder + "/000001/mine"), "mine");
  EXPECT_EQ(readBytes(folder + "/notes.dtsdfj").size(), 100000u);
  uint64_t bytes = 0;
  int journals = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!isJournal(entry.path())) continue;
    bytes += fs::file_size(entry.path());
    ++journals;
  }
  EXPECT_EQ(journals, 3) << "old journals should be kept";
  EXPECT_LE(bytes, options.max_bytes + 3 * kFileHeadBytes);
  JournalWriter journal(options);
  JournaledMap map(journaledParams(), journal);
  map.fuse(image(0), 0.0);
  EXPECT_FALSE(journal.written().get());
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path() != journal.path() && isJournal(entry.path())) fs::remove(entry.path());
  }
  map.clear();
  map.fuse(image(1), 1.0);
  EXPECT_TRUE(journal.written().get()) << "removed journals should not count towards the limit";
}

TEST_F(Journal, StopsIfTheDiskIsTooSlow) {
  std::atomic<bool> is_slow{true};
  JournalWriter::Options options = journalOptions(folder_.path());
  options.max_waiting = 60000;
  options.write = [&](int descriptor, const void* data, size_t bytes) {
    while (is_slow && bytes > 1000) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return ::write(descriptor, data, bytes);
  };
  JournalWriter journal(options);
  JournaledMap map(journaledParams(), journal);
  for (int i = 0; i < kCount; ++i) map.fuse(image(i), 0.1 * i);  // must not block
  EXPECT_TRUE(contains(journal.report().problem, "too slow"));
  EXPECT_LE(journal.report().waiting_bytes, options.max_waiting);
  is_slow = false;
  EXPECT_FALSE(journal.written().get());
}

TEST_F(Journal, OtherFilesAreRefused) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_FALSE(isJournal(folder_ / "pipe"));
  EXPECT_TRUE(contains(errorOf([&] { JournalReplay(folder_ / "pipe"); }), "cannot read"));
  writeBytes(folder_ / "text", "some text, not a journal");
  EXPECT_TRUE(contains(errorOf([&] { JournalReplay(folder_ / "text"); }), "is not a journal"));
  // If a record claims to be a terabyte long, the reader must not allocate that much memory.
  const std::string sparse = folder_ / "sparse.dtsdfj";
  const Bytes head = fileHead(journal::kPurpose);
  ByteWriter record;
  record.putText(journal::kBegin).put(uint32_t{0}).put(uint64_t{1} << 40).put(uint64_t{0});
  writeBytes(sparse, std::string(head.begin(), head.end()) +
                         std::string(record.bytes.begin(), record.bytes.end()));
  fs::resize_file(sparse, (uint64_t{1} << 40) + 40);
  rusage before, after;
  getrusage(RUSAGE_SELF, &before);
  EXPECT_NE(errorOf([&] { JournalReplay journal(sparse); }), "");
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 64 << 10);
}

}  // namespace
}  // namespace dtsdf
