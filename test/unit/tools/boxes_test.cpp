// Tests that joined maps of boxes equal the map built by a single process, byte for byte.
#include "tools/boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <sstream>

#include "io/map_box.h"
#include "support/random_seed.h"
#include "support/run_program.h"
#include "support/scene_colours.h"

namespace dtsdf {
namespace {

bool same(const BlockExtent& a, const BlockExtent& b) {
  return packKey(a.first) == packKey(b.first) && packKey(a.last) == packKey(b.last);
}

TEST(BoxText, RoundTrips) {
  const BlockExtent all;
  EXPECT_EQ(boxText(all, 0.16), "x=..,y=..,z=..");
  const BlockExtent box{{-3, -kMaxBlockCoordinate, 0}, {8, -1, kMaxBlockCoordinate}};
  EXPECT_EQ(boxText(box, 0.16), "x=-0.48..1.44,y=..0,z=0..");
  for (const double block_m : {0.16, 0.4 / 3.0, static_cast<double>(0.012f) * 8}) {
    EXPECT_TRUE(same(parseBox(boxText(box, block_m), block_m), box));
    EXPECT_TRUE(same(parseBox(boxText(all, block_m), block_m), all));
  }
  for (const char* wrong : {"", "x=0..1", "x=0..1,y=..,z=1", "x=1..0,y=..,z=..", "x=a..,y=..,z=..",
                            "y=..,x=..,z=..", "x=1e30..,y=..,z=.."}) {
    EXPECT_THROW(parseBox(wrong, 0.16), UsageError) << wrong;
  }
}

/// Divides space into `count` boxes at random planes.
std::vector<BlockExtent> cutAtRandom(size_t count, std::mt19937& random) {
  std::vector<BlockExtent> boxes{BlockExtent()};
  constexpr int32_t BlockKey::*kAxes[] = {&BlockKey::x, &BlockKey::y, &BlockKey::z};
  while (boxes.size() < count) {
    BlockExtent& box = boxes[random() % boxes.size()];
    const auto axis = kAxes[random() % 3];
    if (box.first.*axis == box.last.*axis) continue;
    std::uniform_int_distribution<int32_t> cuts(box.first.*axis, box.last.*axis - 1);
    BlockExtent other = box;
    box.last.*axis = cuts(random);
    other.first.*axis = box.last.*axis + 1;
    boxes.push_back(other);
  }
  return boxes;
}

TEST(MissingBoxes, AreThoseThatWereLeftOut) {
  std::mt19937 random(caseSeed(0));
  const std::vector<BlockExtent> boxes = cutAtRandom(1000, random);
  EXPECT_TRUE(missingBoxes(boxes).empty());
  for (int i = 0; i < 5; ++i) {
    std::vector<BlockExtent> others = boxes;
    const size_t left_out = random() % boxes.size();
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    const std::vector<BlockExtent> missing = missingBoxes(others);
    ASSERT_EQ(missing.size(), 1u);
    EXPECT_TRUE(same(missing[0], boxes[left_out]));
  }
  EXPECT_THROW(missingBoxes({boxes[3], boxes[4], boxes[3]}), std::runtime_error);
  EXPECT_TRUE(same(missingBoxes({}).at(0), BlockExtent()));
}

TEST(IndexRanges, CountEachIndexOnce) {
  IndexRanges ranges;
  for (const uint64_t index : {1, 2, 3, 7, 9, 10}) appendIndex(index, ranges);
  EXPECT_EQ(ranges.size(), 3u);
  EXPECT_EQ(countOfUnion(ranges), 6u);
  ranges.insert(ranges.end(), {{0, 4}, {2, 8}});
  EXPECT_EQ(countOfUnion(ranges), 11u);
  EXPECT_EQ(countOfUnion({}), 0u);
}

/// A lap through the room, with one empty frame. The second half of the lap is shifted by 60 m.
class Boxes : public testing::Test {
 protected:
  static constexpr int kFrames = 14;

  Boxes() {
    std::vector<Eigen::Isometry3d> poses;
    for (int i = 0; i < kFrames; ++i) poses.push_back(roomCameraPose(1.6 * i));
    poses[5] = lookAt({0.0, 0.0, 5.0}, {0.0, 0.0, 9.0}, Eigen::Vector3d::UnitX());
    const auto moved = [](size_t i, const Eigen::Isometry3d& T_W_C) -> Eigen::Isometry3d {
      return Eigen::Translation3d(i < kFrames / 2 ? 0.0 : 60.0, 0.0, 0.0) * T_W_C;
    };
    Scene scene = makeRoomScene();
    scene.add(makeBox({1.6, 1.2, 0.8}, {0.5, 0.5, 0.5}, 0.3));
    writeSceneRecording(recording_.path(), scene, poses, 80, 60, moved);
    writeSceneColours(
        recording_.path(), scene, [](const Eigen::Vector3d& p) { return wavesAt(p); }, poses, 80,
        60);
  }

  Outcome run(const std::string& command) const { return runIn(out_, command); }

  std::string reconstruct(const std::string& settings, const std::string& map,
                          const std::string& more = "") const {
    return DTSDF_RECONSTRUCT " " + recording_.path() + common() + settings + " --save-map " +
           (out_ / map) + " " + more;
  }

  static std::string common() {
    return " --backend cpu --threads 1 --set poses/mode=tf map/voxel_size_m=0.08 "
           "mesh/min_support=2 ";
  }

  std::vector<std::string> plan(const std::string& settings, const std::string& how) const {
    const Outcome outcome =
        run(DTSDF_MAP_TOOL " boxes " + recording_.path() + " " + how + common() + settings);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::istringstream lines(outcome.out);
    std::vector<std::string> boxes;
    for (std::string line; std::getline(lines, line);) boxes.push_back(line);
    return boxes;
  }

  void make(const std::vector<std::string>& boxes, const std::string& settings) const {
    for (size_t i = 0; i < boxes.size(); ++i) {
      const Outcome outcome =
          run(reconstruct(settings, "box" + std::to_string(i) + ".dtsdf", "--only " + boxes[i]));
      EXPECT_EQ(outcome.exit_code, 0) << boxes[i] << outcome.err;
    }
  }

  Outcome join() const {
    return run(DTSDF_MAP_TOOL " join " + (out_ / "box*.dtsdf") + " --save-map " +
               (out_ / "all.dtsdf"));
  }

  /// Checks that joining the boxes gives the same map and mesh as a single process.
  void expectSame(const std::string& settings, const std::string& how) const {
    const Outcome one = run(reconstruct(settings, "one.dtsdf", "--mesh " + (out_ / "one.ply")));
    ASSERT_EQ(one.exit_code, 0) << one.err;
    make(plan(settings, how), settings);
    const Outcome joined = join();
    ASSERT_EQ(joined.exit_code, 0) << joined.err;
    EXPECT_TRUE(readBytes(out_ / "all.dtsdf") == readBytes(out_ / "one.dtsdf"));
    const Outcome mesh = run(DTSDF_MAP_TOOL " mesh " + (out_ / "all.dtsdf") + " " +
                             (out_ / "all.ply") + " --set threads=1");
    ASSERT_EQ(mesh.exit_code, 0) << mesh.err;
    EXPECT_TRUE(readBytes(out_ / "all.ply") == readBytes(out_ / "one.ply"));
  }

  const TemporaryFolder recording_, out_;
};

constexpr char kPlain[] = "colour/enabled=never ";
constexpr char kFixed[] = "colour/exposure=fixed ", kDepth[] = "colour/max_depth_m=1.8 ";

TEST_F(Boxes, GiveTheSameMapWithSpace) {
  expectSame(std::string(kPlain) + "space/enabled=true space/max_range_m=3 space/cell_voxels=2",
             "--box-m 8");
}

TEST_F(Boxes, GiveTheSameColours) {
  const std::string space = "space/enabled=true space/max_range_m=3 space/cell_voxels=2";
  EXPECT_NE(run(reconstruct(kFixed, "box0.dtsdf", "--only x=..1,y=..,z=.."))
                .err.find("colour/max_depth_m=5"),
            std::string::npos);
  expectSame(std::string(kFixed) + kDepth + space, "--count 6");
}

/// Each box is continued from its own map of the first half of the recording.
TEST_F(Boxes, CanBeContinued) {
  const std::string half = std::string(kPlain), first = "--frames :6 ", second = "--frames 7: ";
  ASSERT_EQ(run(reconstruct(half, "begun.dtsdf", first)).exit_code, 0);
  const Outcome one =
      run(reconstruct(half, "one.dtsdf", second + "--load-map " + (out_ / "begun.dtsdf")));
  ASSERT_EQ(one.exit_code, 0) << one.err;
  const std::vector<std::string> boxes = plan(half, "--count 5");
  for (size_t i = 0; i < boxes.size(); ++i) {
    const std::string begun = "begun" + std::to_string(i) + ".dtsdf", only = "--only " + boxes[i];
    ASSERT_EQ(run(reconstruct(half, begun, first + only)).exit_code, 0);
    const Outcome outcome = run(reconstruct(half, "box" + std::to_string(i) + ".dtsdf",
                                            second + only + " --load-map " + (out_ / begun)));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  const Outcome joined = join();
  ASSERT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_TRUE(readBytes(out_ / "all.dtsdf") == readBytes(out_ / "one.dtsdf"));
}

TEST_F(Boxes, MissingOrOverlappingBoxesAreReported) {
  const std::vector<std::string> boxes = plan(kPlain, "--count 4");
  ASSERT_EQ(boxes.size(), 4u);
  make({boxes[0], boxes[1], boxes[3]}, kPlain);
  const Outcome missing = join();
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("boxes are missing: " + boxes[2]), std::string::npos) << missing.err;
  // Once the missing box has been mapped, all boxes can be joined.
  make({boxes[0], boxes[1], boxes[2], boxes[3]}, kPlain);
  EXPECT_EQ(join().exit_code, 0);
  make({boxes[0], boxes[0]}, kPlain);
  EXPECT_NE(join().err.find("two boxes overlap"), std::string::npos);
}

TEST_F(Boxes, RefuseOptionsThatChangeTheResult) {
  const std::string only = "--only x=..1,y=..,z=..";
  const auto expectError = [&](const std::string& settings, const std::string& more) {
    EXPECT_NE(run(reconstruct(kPlain + settings, "box0.dtsdf", more)).exit_code, 0);
    EXPECT_FALSE(std::filesystem::exists(out_ / "box0.dtsdf"));
  };
  expectError("map/keep_radius_m=20", only);
  expectError("", only + " --poses-mode refine");
  expectError("map/max_memory_mb=1 map/voxel_size_m=0.02", only);
  ASSERT_EQ(run(reconstruct(kPlain, "whole.dtsdf")).exit_code, 0);
  expectError("", only + " --load-map " + (out_ / "whole.dtsdf"));
  EXPECT_EQ(
      run(DTSDF_MAP_TOOL " join " + (out_ / "whole.dtsdf") + " --save-map " + (out_ / "all.dtsdf"))
          .exit_code,
      1);
  make({"x=..1,y=..,z=.."}, kPlain);
  EXPECT_EQ(run(reconstruct(kPlain, "more.dtsdf", "--load-map " + (out_ / "box0.dtsdf"))).exit_code,
            1);
}

}  // namespace
}  // namespace dtsdf
