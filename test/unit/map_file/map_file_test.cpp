// Tests that saved maps load unchanged, and that damaged map files are refused.
#include "dtsdf_mapping/io/map_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <thread>

#include "io/map_chunks.h"
#include "io/map_format.h"
#include "kernels/core/grid.h"
#include "support/map_equality.h"
#include "support/random_seed.h"
#include "support/saved_maps.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

MapperParams smallParams() {
  MapperParams params = roomParams(0.08f);
  params.space.enabled = true;
  return params;
}

const MapContents& smallMap() {
  static const MapContents contents = [] {
    MapContents made = roomContents(true, smallParams());
    made.map_frame = "odom";
    made.stamp_s = 1600000000.125;
    return made;
  }();
  return contents;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// A file split into records, so that single records can be changed and their checksums corrected.
struct SplitMapFile {
  struct Part {
    std::string kind;
    uint32_t flags;
    Bytes content;
  };
  std::vector<Part> parts;
  Bytes end_of_content;  ///< End of the last record, with content hash and checksums.

  explicit SplitMapFile(const std::string& path) {
    const RecordFile file(path, map_format::kPurpose, "map file");
    for (const Record& record : file.records()) {
      parts.push_back({record.name(), record.flags, file.read(record, 1 << 30)});
    }
    end_of_content.assign(parts.back().content.begin() + 16, parts.back().content.end());
    parts.pop_back();
  }

  Part& get(const char* kind) {
    for (Part& part : parts) {
      if (part.kind == kind) return part;
    }
    throw std::runtime_error("no such record");
  }

  /// The file, with the checksums of all records corrected, but with the old `end_of_content`.
  std::string bytes() const {
    const Bytes head = fileHead(map_format::kPurpose);
    std::string text(head.begin(), head.end());
    RecordWriter out([&](const Bytes& record) { text.append(record.begin(), record.end()); });
    for (const Part& part : parts) out.put(part.kind.c_str(), part.flags, part.content);
    ByteWriter end;
    end.put(out.records()).put(out.headHash());
    end.bytes.insert(end.bytes.end(), end_of_content.begin(), end_of_content.end());
    out.put(map_format::kEnd, 0, end.bytes);
    return text;
  }
};

class MapFile : public testing::Test {
 protected:
  MapFile() : path_(folder_ / "map.dtsdf") {
    saved_ = saveMap(smallMap(), path_, 1);
    bytes_ = readBytes(path_);
  }

  std::string errorOfBytes(const std::string& bytes) {
    writeBytes(folder_ / "other.dtsdf", bytes);
    return errorOf([&] { loadMap(folder_ / "other.dtsdf"); });
  }

  SplitMapFile splitMapFile() const { return SplitMapFile(path_); }

  TemporaryFolder folder_;
  std::string path_, bytes_;
  MapInfo saved_;
};

TEST_F(MapFile, RestoresTheSavedMap) {
  EXPECT_TRUE(sameContents(loadMap(path_), smallMap()));
  EXPECT_EQ(saved_.file_bytes, bytes_.size());
  EXPECT_EQ(saved_.size.blocks, smallMap().blocks.size());
  EXPECT_LT(bytes_.size(), saved_.size.bytes() / 2) << "the file should be compressed";
}

TEST_F(MapFile, StoresTheLevelInItsOwnRecord) {
  EXPECT_FALSE(readMapInfo(path_).T_W_M);
  EXPECT_FALSE(loadMap(path_).T_W_M);
  MapContents levelled = copyOf(smallMap());
  levelled.T_W_M = Eigen::Isometry3d::Identity();
  levelled.T_W_M->linear() =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1.0, 2.0, 0.3).normalized()).toRotationMatrix();
  levelled.T_W_M->translation() = Eigen::Vector3d(0.0, 0.0, 1.0 / 3.0);
  const std::string path = folder_ / "levelled.dtsdf";
  const MapInfo saved = saveMap(levelled, path);
  EXPECT_EQ(saved.content_hash, saved_.content_hash)
      << "the levelling transform should not affect the content hash";
  EXPECT_TRUE(sameContents(loadMap(path), levelled));
  ASSERT_TRUE(readMapInfo(path).T_W_M);
  EXPECT_EQ(readMapInfo(path).T_W_M->matrix(), levelled.T_W_M->matrix());

  SplitMapFile bent(path);
  EXPECT_EQ(bent.get("LEVL").flags, 0u)
      << "readers should not be allowed to skip the levelling transform";
  bent.get("LEVL").content[6] ^= 0x10;
  EXPECT_TRUE(contains(errorOfBytes(bent.bytes()), "its levelling transform is not rigid"));
  bent.get("LEVL").content.resize(88);
  EXPECT_TRUE(contains(errorOfBytes(bent.bytes()), "damaged"));
}

TEST(Level, MustMatchTheContinuedRun) {
  MapContents plain = copyOf(smallMap()), levelled = copyOf(smallMap());
  levelled.T_W_M = Eigen::Isometry3d::Identity();
  EXPECT_EQ(errorOf([&] { checkLevel(plain, false); }), "");
  EXPECT_EQ(errorOf([&] { checkLevel(levelled, true); }), "");
  EXPECT_TRUE(contains(errorOf([&] { checkLevel(plain, true); }), "set map/level to none"));
  EXPECT_TRUE(contains(errorOf([&] { checkLevel(levelled, false); }), "floor or imu"));
  plain.frames = levelled.frames = 0;
  EXPECT_EQ(errorOf([&] { checkLevel(plain, true); }), "");
  EXPECT_EQ(errorOf([&] { checkLevel(levelled, false); }), "");
}

TEST_F(MapFile, BytesDoNotDependOnThreads) {
  for (const int threads : {0, 2, 7}) {
    saveMap(smallMap(), folder_ / "again.dtsdf", threads);
    EXPECT_TRUE(readBytes(folder_ / "again.dtsdf") == bytes_);
    EXPECT_TRUE(sameContents(loadMap(path_, kNoMapLimit, threads), smallMap()));
  }
}

TEST_F(MapFile, LoadedAndSavedAgainHasTheSameBytes) {
  const MapperParams params = withSettingsOf(smallMap(), smallParams());
  const auto mapper = makeMapper(params, loadMap(path_));
  MapContents contents = mapper->contents();
  contents.map_frame = "odom";
  contents.stamp_s = smallMap().stamp_s;
  saveMap(contents, folder_ / "again.dtsdf");
  EXPECT_TRUE(readBytes(folder_ / "again.dtsdf") == bytes_);
}

TEST_F(MapFile, OnlyEqualMapsHaveEqualHashes) {
  EXPECT_EQ(contentHash(smallMap()), saved_.content_hash);
  EXPECT_EQ(contentHash(smallMap(), 3), saved_.content_hash);
  EXPECT_EQ(readMapInfo(path_).content_hash, saved_.content_hash);
  MapContents other = copyOf(smallMap());
  other.map_frame = "map";
  other.stamp_s = 5.0;
  other.settings["mesh/min_support"] = 1;
  EXPECT_EQ(contentHash(other), saved_.content_hash) << "the hash should depend only on the map";
  const auto expectOther = [&](const auto& change) {
    MapContents changed = copyOf(smallMap());
    change(changed);
    EXPECT_NE(contentHash(changed), saved_.content_hash);
  };
  expectOther([](MapContents& c) { c.voxels[c.voxels.size() - 1] ^= 1; });
  expectOther([](MapContents& c) { c.colours[0] ^= 1u << 31; });
  expectOther([](MapContents& c) { --c.blocks.front().key.z; });
  expectOther([](MapContents& c) { ++c.frames; });
  expectOther([](MapContents& c) { c.exposure[2] += 0.001f; });
  expectOther([](MapContents& c) { c.settings["map/voxel_size_m"] = 0.05; });
  expectOther([](MapContents& c) { c.free_cubes.back().cells[3] ^= 2; });
  expectOther([](MapContents& c) { --c.free_cubes.front().key.z; });
  expectOther([](MapContents& c) { c.cell_voxels = 8; });
  expectOther([](MapContents& c) {
    c.free_cubes.clear();
    c.cell_voxels = 0;
  });
}

TEST_F(MapFile, EmptyMapsCanBeSaved) {
  MapContents empty = makeMapper(roomParams())->contents();
  saveMap(empty, path_);
  EXPECT_TRUE(sameContents(loadMap(path_), empty));
  EXPECT_EQ(readMapInfo(path_).size.blocks, 0u);
}

/// Several chunks of blocks; the last chunk is not full.
TEST_F(MapFile, RestoresMapsOfManyChunks) {
  const MapContents contents = roomContents(true, roomParams(0.015f));
  ASSERT_GT(contents.blocks.size(), 3 * kBlocksPerChunk);
  saveMap(contents, path_);
  EXPECT_TRUE(sameContents(loadMap(path_), contents));
}

TEST_F(MapFile, SettingsAreRestoredExactly) {
  MapContents contents = copyOf(smallMap());
  contents.settings["map/voxel_size_m"] = 0.012345678;
  contents.settings["x/a"] = 0.1;
  contents.settings["x/b"] = 1.0 / 3.0;
  contents.settings["x/c"] = 2.0;
  contents.settings["x/d"] = 2;
  contents.settings["x/e"] = -1e-300;
  contents.settings["x/f"] = true;
  contents.settings["x/g"] = std::string("it's: so");
  saveMap(contents, path_);
  EXPECT_EQ(loadMap(path_).settings, contents.settings);
}

/// The file records how poses were found, unless the input poses were used unchanged.
TEST_F(MapFile, RecordsHowPosesWereFound) {
  MapContents contents = copyOf(smallMap());
  ParamTree settings = readMapInfo(path_).settings;
  EXPECT_EQ(settings.count("poses/mode"), 0u);
  contents.poses.sigma_m = 0.5;  // no effect in this mode
  saveMap(contents, path_);
  EXPECT_TRUE(readBytes(path_) == bytes_);

  contents.poses.mode = PoseMode::kRefine;
  contents.poses.drop_misfits = true;
  saveMap(contents, path_);
  settings.merge(toTree(contents.poses));
  const MapInfo info = readMapInfo(path_);
  EXPECT_EQ(info.settings, settings);
  EXPECT_EQ(toTree(info.poses), toTree(contents.poses));
  const std::string bytes = readBytes(path_);
  saveMap(loadMap(path_), path_);
  EXPECT_TRUE(readBytes(path_) == bytes);
}

/// The writer refuses what the reader would refuse, and leaves the old file unchanged.
TEST_F(MapFile, RefusesToWriteUnreadableFiles) {
  const auto expectRefused = [&](const std::function<void(MapContents&)>& change) {
    MapContents contents = copyOf(smallMap());
    change(contents);
    EXPECT_NE(errorOf([&] { saveMap(contents, path_); }), "");
    EXPECT_TRUE(readBytes(path_) == bytes_);
  };
  expectRefused([](MapContents& c) { std::swap(c.blocks[0], c.blocks[1]); });
  expectRefused([](MapContents& c) { c.map_frame.assign(10 << 20, 'f'); });
  expectRefused([](MapContents& c) { c.settings["x/a"] = std::string("two\nlines"); });
  expectRefused([](MapContents& c) { c.settings["map/voxel_size_m"] = -1.0; });
  expectRefused([](MapContents& c) {
    c.poses.mode = PoseMode::kRefine;
    c.poses.sigma_m = -1.0;
  });
}

TEST_F(MapFile, InfoNeedsNoVoxels) {
  const MapInfo info = readMapInfo(path_);
  EXPECT_EQ(info.settings, smallMap().settings);
  EXPECT_EQ(info.map_frame, "odom");
  EXPECT_EQ(info.frames, smallMap().frames);
  EXPECT_TRUE(info.painted);
  EXPECT_EQ(info.size.voxel_arrays * 512, smallMap().voxels.size());
  EXPECT_EQ(info.size.bricks * 64, smallMap().colours.size());
  EXPECT_EQ(info.cell_voxels, 4);
  EXPECT_EQ(info.size.free_cubes, smallMap().free_cubes.size());
  EXPECT_EQ(info.file_bytes, bytes_.size());
  EXPECT_EQ(info.least.z, smallMap().blocks.front().key.z);
  EXPECT_EQ(info.most.z, smallMap().blocks.back().key.z);
}

TEST_F(MapFile, WithABitFlippedIsRefused) {
  // All bytes of the headers and of the small records, and a sample of the other bytes.
  const size_t step = std::max<size_t>(1, bytes_.size() / 1000);
  for (size_t i = 0; i < bytes_.size(); i += i < 6000 || i + 200 > bytes_.size() ? 1 : step) {
    std::string spoilt = bytes_;
    spoilt[i] = static_cast<char>(spoilt[i] ^ (1 << i % 8));
    const std::string error = errorOfBytes(spoilt);
    EXPECT_TRUE(contains(error, "other.dtsdf")) << "byte " << i << ": " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

TEST_F(MapFile, IsRefusedIfTruncated) {
  for (size_t length = 0; length < bytes_.size();
       length += length < 6000 ? 7 : bytes_.size() / 500) {
    EXPECT_TRUE(contains(errorOfBytes(bytes_.substr(0, length)), "other.dtsdf")) << length;
  }
  EXPECT_TRUE(contains(errorOfBytes(bytes_ + "x"), "damaged"));
}

TEST_F(MapFile, WithMissingOrDuplicateRecordsIsRefused) {
  for (size_t i = 0; i < splitMapFile().parts.size(); ++i) {
    SplitMapFile apart = splitMapFile(), twice = apart, swapped = apart;
    apart.parts.erase(apart.parts.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_TRUE(contains(errorOfBytes(apart.bytes()), "damaged")) << twice.parts[i].kind;
    const SplitMapFile::Part part = twice.parts[i];
    twice.parts.insert(twice.parts.begin(), part);
    EXPECT_TRUE(contains(errorOfBytes(twice.bytes()), "damaged")) << part.kind << " twice";
  }
}

TEST_F(MapFile, SkipsUnknownOptionalRecords) {
  SplitMapFile apart = splitMapFile(), required = apart;
  apart.parts.insert(apart.parts.begin() + 2, {"XTRA", kMayBeSkipped, {1, 2, 3}});
  writeBytes(path_, apart.bytes());
  EXPECT_TRUE(sameContents(loadMap(path_), smallMap()));
  required.parts.insert(required.parts.begin() + 2, {"XTRA", 0, {1, 2, 3}});
  const std::string error = errorOfBytes(required.bytes());
  EXPECT_TRUE(contains(error, "XTRA") && contains(error, "use a newer version")) << error;
}

TEST_F(MapFile, OfANewerFormatIsRefused) {
  std::string newer = bytes_;
  newer[8] = 2;
  const std::string error = errorOfBytes(newer);
  EXPECT_TRUE(contains(error, "version 2") && contains(error, "use a newer version")) << error;
}

/// No memory is allocated for sizes larger than the file: an allocation of 2^60 bytes would fail.
TEST_F(MapFile, WithWrongSizesIsRefused) {
  for (size_t number = 0; number < 4; ++number) {
    for (const uint64_t value : {uint64_t{1} << 60, ~uint64_t{0}, uint64_t{1} << 40, uint64_t{0}}) {
      SplitMapFile apart = splitMapFile();
      uint8_t* const at = apart.get("STAT").content.data() + 8 * number;
      if (numberOf<uint64_t>(at) == value) continue;
      const auto bytes = littleEndianBytes(value);
      std::copy(bytes.begin(), bytes.end(), at);
      EXPECT_TRUE(contains(errorOfBytes(apart.bytes()), "damaged")) << number << " " << value;
    }
  }
  std::string longer = bytes_;
  longer[kFileHeadBytes + 15] = 0x10;  // the length of the first record
  EXPECT_TRUE(contains(errorOfBytes(longer), "damaged"));
}

/// The file of a map that covers only a box also stores the box and the indices of its frames.
TEST_F(MapFile, OfABoxStoresTheBox) {
  MapBox box{{-4, -5, -6}, {1, 2, 3}, 2, {{0, 4}, {7, 9}}, {{7, 9}}};
  const auto mapper = makeProbedMapper(smallParams());
  saveBoxOf(*mapper, {}, box, path_);
  const std::optional<MapBox> read = MapChunks(path_).box();
  ASSERT_TRUE(read);
  EXPECT_EQ(read->fused, box.fused);
  EXPECT_EQ(read->supporting, box.supporting);
  EXPECT_EQ(read->last.z, 3);
  EXPECT_EQ(read->recordings, 2u);
  SplitMapFile apart = splitMapFile();
  apart.get("BOX ").content[32] = 200;  // the number of ranges
  EXPECT_TRUE(contains(errorOfBytes(apart.bytes()), "damaged"));
}

TEST_F(MapFile, OverTheMemoryLimitIsRefused) {
  const size_t bytes = sizeOf(smallMap()).bytes();
  EXPECT_EQ(errorOf([&] { loadMap(path_, bytes); }), "");
  const std::string error = errorOf([&] { loadMap(path_, bytes - 1); });
  EXPECT_TRUE(contains(error, "max_memory_mb")) << error;
}

TEST_F(MapFile, FreeCellsCountTowardsTheLimit) {
  MapContents contents = copyOf(smallMap());
  MapperParams params;
  params.map.max_memory_mb = static_cast<int>(sizeOf(contents.blocks).bytes() >> 20) + 1;
  const size_t allowed = static_cast<size_t>(params.map.max_memory_mb) << 20;
  contents.free_cubes.clear();
  for (int x = 0; sizeOf(contents).bytes() <= allowed; ++x) {
    contents.free_cubes.push_back({{x, 0, 0}, {1}});
  }
  saveMap(contents, path_);
  EXPECT_TRUE(contains(errorOf([&] { loadMap(path_, params); }), "max_memory_mb"));
  ++params.map.max_memory_mb;
  EXPECT_EQ(errorOf([&] { EXPECT_TRUE(sameContents(loadMap(path_, params), contents)); }), "");
}

/// A small file may expand to a large map, since zeros compress extremely well.
TEST_F(MapFile, BeyondTheBudgetTakesNoMemory) {
  constexpr int kSide = 29;  // 24389 blocks of six arrays: 0.56 GiB
  MapContents head;
  head.settings = copyOf(smallMap()).settings;
  for (int x = 0; x < kSide; ++x) {
    for (int y = 0; y < kSide; ++y) {
      for (int z = 0; z < kSide; ++z) head.blocks.push_back({{x, y, z}, 0x3f, 0});
    }
  }
  std::sort(head.blocks.begin(), head.blocks.end(),
            [](const MapBlock& a, const MapBlock& b) { return packKey(a.key) < packKey(b.key); });
  const std::string path = folder_ / "large.dtsdf";
  const MapInfo saved = saveMapInChunks(
      head,
      [&](size_t chunk) {
        MapContents part;
        part.voxels = PlainArray<uint64_t>(blocksOfChunk(head.blocks, chunk).size() * 6 * 512);
        std::fill_n(part.voxels.data(), part.voxels.size(), 0);
        return part;
      },
      path, 1);
  EXPECT_LT(saved.file_bytes, 2000000u);
  ASSERT_GT(saved.size.bytes(), size_t{1} << 29);
  rusage before, after;
  getrusage(RUSAGE_SELF, &before);
  MapperParams params = smallParams();
  params.map.max_memory_mb = 512;
  const std::string error = errorOf([&] { loadMap(path, params); });
  EXPECT_TRUE(contains(error, "512 MiB are allowed; raise map/max_memory_mb")) << error;
  EXPECT_EQ(errorOf([&] { MapChunks(path, params); }), error);
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 64 << 10);
}

TEST_F(MapFile, OtherFilesAreRefused) {
  writeBytes(folder_ / "text", "This is not a map, though it is longer than its header.");
  EXPECT_TRUE(contains(errorOf([&] { loadMap(folder_ / "text"); }), "is not a map file"));
  EXPECT_TRUE(contains(errorOf([&] { loadMap(folder_ / "missing.dtsdf"); }), "cannot read"));
  EXPECT_TRUE(contains(errorOf([&] { loadMap(folder_.path()); }), "cannot read"));
  EXPECT_TRUE(contains(errorOf([&] { loadMap("/dev/zero"); }), "cannot read"));
  ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  EXPECT_TRUE(contains(errorOf([&] { loadMap(folder_ / "fifo"); }), "cannot read"));
}

/// DTSDF_KILLS sets the number of kills (default: 10).
TEST_F(MapFile, IsIntactAfterAKilledSave) {
  const MapContents larger = roomContents(true, roomParams(0.015f));
  const auto start = std::chrono::steady_clock::now();
  const MapInfo saved = saveMap(larger, folder_ / "larger.dtsdf");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const char* const wanted = std::getenv("DTSDF_KILLS");
  const int kills = wanted == nullptr ? 10 : std::atoi(wanted);
  std::mt19937 random(caseSeed(0));
  int killed_in_time = 0;
  for (int i = 0; i < kills; ++i) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      while (true) saveMap(larger, path_, 1);
    }
    const double wait_s = std::uniform_real_distribution<double>(0.0, 1.5)(random) * took.count();
    std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the save itself should not fail";
    const bool is_old = readBytes(path_) == bytes_;
    if (is_old) ++killed_in_time;
    const uint64_t hash = contentHash(loadMap(path_));
    EXPECT_EQ(hash, is_old ? saved_.content_hash : saved.content_hash);
    writeBytes(path_, bytes_);
  }
  EXPECT_GT(killed_in_time, 0) << "at least one save should be killed before it ends";
}

TEST_F(MapFile, WithInvalidFreeCellsIsRefused) {
  const auto expectRefused = [&](const Bytes& content) {
    SplitMapFile apart = splitMapFile();
    apart.get("FREE").content = content;
    EXPECT_TRUE(contains(errorOfBytes(apart.bytes()), "damaged")) << content.size();
  };
  const Bytes right = splitMapFile().get("FREE").content;
  for (const size_t bytes :
       {size_t{0}, size_t{7}, size_t{8}, right.size() - 1, right.size() - 80}) {
    expectRefused({right.begin(), right.begin() + static_cast<std::ptrdiff_t>(bytes)});
  }
  for (const uint8_t cell_voxels : {0, 3, 255}) {
    Bytes wrong = right;
    wrong[0] = cell_voxels;
    expectRefused(wrong);
  }
}

/// Runs examples/read_map.py on a file and appends its output to `output`. @return Exit code.
int readByExample(const std::string& path, std::string& output) {
  FILE* pipe = popen((std::string(DTSDF_READ_MAP) + " " + path + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return -1;
  char buffer[4096];
  while (std::fgets(buffer, sizeof(buffer), pipe) != nullptr) output += buffer;
  return WEXITSTATUS(pclose(pipe));
}

TEST_F(MapFile, IsReadByThePythonExample) {
  std::string output;
  const int exit_code = readByExample(path_, output);
  if (contains(output, "No module named")) GTEST_SKIP() << output;
  ASSERT_EQ(exit_code, 0) << output;
  size_t known = 0, painted = 0;
  double distances = 0.0, weights = 0.0;
  uint64_t colours = 0;
  const MapContents& map = smallMap();
  for (size_t i = 0; i < map.voxels.size(); ++i) {
    Voxel voxel;
    std::memcpy(&voxel, &map.voxels[i], sizeof(voxel));
    if (evidenceOf(voxel) <= 0) continue;
    ++known;
    distances += sdfOf(voxel);
    weights += weightOf(voxel);
  }
  for (size_t i = 0; i < map.colours.size(); ++i) {
    const uint32_t word = map.colours[i];
    colours += (word & 255) + (word >> 8 & 255) + (word >> 16 & 255);
    if (word >> 24 != 0) ++painted;
  }
  size_t free_cells = 0;
  for (const MapFreeCube& cube : map.free_cubes) {
    for (const uint64_t word : cube.cells) {
      free_cells += static_cast<size_t>(__builtin_popcountll(word));
    }
  }
  char expected[512];
  std::snprintf(expected, sizeof(expected),
                "voxel size 0.08\nblocks %zu\nvoxel arrays %zu\nknown voxels %zu\n"
                "sum of distances %.6f\nsum of weights %.6f\nfree cells %zu\npainted voxels %zu\n"
                "sum of colours %llu\n",
                map.blocks.size(), map.voxels.size() / 512, known, distances, weights, free_cells,
                painted, static_cast<unsigned long long>(colours));
  EXPECT_EQ(output, expected);
}

}  // namespace
}  // namespace dtsdf
