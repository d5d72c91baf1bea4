// Tests that a map's contents can be moved to another mapper, which then continues the map.
#include <gtest/gtest.h>

#include <limits>
#include <tuple>

#include "support/map_equality.h"
#include "support/saved_maps.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

using Mode = std::tuple<FusionMode, bool>;

class Contents : public testing::TestWithParam<Mode> {
 protected:
  MapperParams params() const {
    MapperParams params = makeCpuParams(std::get<0>(GetParam()), std::get<1>(GetParam()), 0.04f, 1);
    params.space.enabled = true;
    return params;
  }
};

/// A map is moved to another mapper during a recording, with everything that affects later frames.
TEST_P(Contents, CanBeContinuedInAnotherMapper) {
  const size_t frames = roomRecording().depth.size();
  for (const bool painted : {false, true}) {
    for (const size_t half : {size_t{1}, frames / 2}) {
      SCOPED_TRACE("after " + std::to_string(half));
      const auto whole = makeProbedMapper(params());
      feed(*whole, 0, frames, painted);
      const auto begun = makeProbedMapper(params());
      feed(*begun, 0, half, painted);
      const auto resumed = makeProbedMapper(params(), Rules(), begun->contents());
      feed(*resumed, half, frames, painted);
      EXPECT_TRUE(sameMaps(*whole, *resumed));
      EXPECT_TRUE(sameContents(whole->contents(), resumed->contents()));
      const Mesh mesh = meshOf(*whole, 0.04f);
      EXPECT_GT(mesh.triangles.size(), 1000u);
      EXPECT_EQ(!mesh.colours.empty(), painted);
      EXPECT_TRUE(sameMeshes(mesh, meshOf(*resumed, 0.04f)));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Modes, Contents,
    testing::Combine(testing::Values(FusionMode::kVoxelProjection, FusionMode::kRayCasting,
                                     FusionMode::kNormalRayCasting),
                     testing::Bool()),
    [](const auto& info) { return modeName(std::get<0>(info.param), std::get<1>(info.param)); });

TEST(ContentsOfAMap, AreRestoredUnchanged) {
  const MapContents contents = roomContents();
  EXPECT_TRUE(contents.painted);
  EXPECT_GT(contents.colours.size(), 0u);
  EXPECT_NE(contents.exposure[0], 1.0f) << "this test needs a gain other than 1";
  const auto mapper = makeMapper(roomParams(), contents);
  EXPECT_TRUE(sameContents(mapper->contents(), contents));
  EXPECT_EQ(mapper->stats().map_bytes, sizeOf(contents.blocks).bytes());
}

TEST(ContentsOfAMap, AreEmptyForAnEmptyMap) {
  const MapContents contents = makeMapper(roomParams())->contents();
  EXPECT_TRUE(contents.blocks.empty());
  const auto mapper = makeMapper(roomParams(), contents);
  EXPECT_TRUE(mapper->updateMesh().blocks.empty());
  feed(*mapper, 0, 2, false);
  EXPECT_GT(mapper->stats().blocks, 0u);
}

TEST(ContentsOfAMap, AreRefusedIfSettingsDiffer) {
  const MapContents contents = roomContents(false);
  const auto refused = [&](const char* key, const auto& change) {
    MapperParams params = roomParams();
    change(params);
    const std::string error = errorOf([&] { makeMapper(params, contents); });
    EXPECT_NE(error.find(key), std::string::npos) << error;
    EXPECT_EQ(errorOf([&] { makeMapper(withSettingsOf(contents, params), contents); }), "");
  };
  refused("map/voxel_size_m", [](MapperParams& p) { p.map.voxel_size_m = 0.021f; });
  refused("map/truncation_voxels", [](MapperParams& p) { p.map.truncation_voxels = 5.0f; });
  refused("map/directional", [](MapperParams& p) { p.map.directional = false; });
  refused("fusion/mode", [](MapperParams& p) { p.fusion.mode = FusionMode::kRayCasting; });
  MapperParams other = roomParams();
  other.fusion.max_depth_m = 3.0f;
  other.mesh.min_support = 1;
  EXPECT_EQ(errorOf([&] { makeMapper(other, contents); }), "")
      << "settings that affect only later frames may differ";
}

/// A maximum distance that is valid for the node's voxel size may span too many cells in a finer
/// map.
TEST(ContentsOfAMap, DistanceLimitsUseTheMapsVoxelSize) {
  const MapContents fine = makeMapper(roomParams(0.005f))->contents();
  MapperParams params = roomParams(0.02f);
  params.space.enabled = true;
  params.space.cell_voxels = 1;
  params.space.max_distance_m = 2.0f;
  const std::string error = errorOf([&] { withSettingsOf(fine, params); });
  EXPECT_NE(error.find("space/max_distance_m"), std::string::npos) << error;
}

TEST(ContentsOfAMap, AreRefusedBeyondTheBudget) {
  const MapContents contents = roomContents(false, roomParams(0.02f));
  MapperParams params = roomParams(0.02f);
  params.map.max_memory_mb = static_cast<int>(sizeOf(contents.blocks).bytes() >> 20);
  ASSERT_GE(params.map.max_memory_mb, 1);
  const std::string error = errorOf([&] { makeMapper(params, contents); });
  EXPECT_NE(error.find("map/max_memory_mb"), std::string::npos) << error;
  ++params.map.max_memory_mb;
  EXPECT_EQ(errorOf([&] { makeMapper(params, contents); }), "");
}

MapperParams spaceParams(int cell_voxels = 2) {
  MapperParams params = roomParams(0.04f);
  params.space.enabled = true;
  params.space.cell_voxels = cell_voxels;
  return params;
}

/// Free cells are moved with the map. A mapper without a free-space grid drops them; one with a
/// different cell size refuses them.
TEST(ContentsOfAMap, IncludeFreeCells) {
  const MapContents contents = roomContents(false, spaceParams());
  EXPECT_EQ(contents.cell_voxels, 2);
  EXPECT_GT(contents.free_cubes.size(), 10u);
  const auto mapper = makeMapper(spaceParams(), contents);
  EXPECT_TRUE(sameContents(mapper->contents(), contents));
  EXPECT_EQ(mapper->stats().map_bytes + mapper->stats().free_bytes, sizeOf(contents).bytes());
  const std::string error = errorOf([&] { makeMapper(spaceParams(4), contents); });
  EXPECT_NE(error.find("space/cell_voxels"), std::string::npos) << error;
  const auto without = makeMapper(roomParams(0.04f), contents);
  EXPECT_TRUE(without->contents().free_cubes.empty());
  EXPECT_EQ(without->contents().cell_voxels, 0);
  EXPECT_EQ(errorOf([&] { makeMapper(spaceParams(4), roomContents(false, roomParams(0.04f))); }),
            "");
}

/// 6000 cubes of free cells, 256 bytes each, must fit into an eighth of the budget.
TEST(ContentsOfAMap, NeedMemoryForFreeCells) {
  MapContents contents = roomContents(false, spaceParams());
  contents.free_cubes.clear();
  for (int32_t i = 0; i < 6000; ++i) {
    contents.free_cubes.push_back({{i % 20, i / 20 % 20, i / 400}, {1}});
  }
  MapperParams params = spaceParams();
  EXPECT_EQ(minMemoryMb(contents, params), 12);
  EXPECT_LT(minMemoryMb(contents, roomParams(0.04f)), 12)
      << "free cells that are dropped should need no memory";
  params.map.max_memory_mb = 12;
  EXPECT_EQ(errorOf([&] { makeMapper(params, contents); }), "");
  params.map.max_memory_mb = 11;
  const std::string error = errorOf([&] { makeMapper(params, contents); });
  EXPECT_NE(error.find("map/max_memory_mb of at least 12"), std::string::npos) << error;
}

TEST(ContentsOfAMap, AreRefusedIfInvalid) {
  const MapContents good = roomContents(true, spaceParams());
  const auto refused = [&](const auto& spoil) {
    MapContents contents = copyOf(good);
    spoil(contents);
    EXPECT_NE(errorOf([&] { makeMapper(spaceParams(), contents); }), "");
  };
  ASSERT_EQ(errorOf([&] { makeMapper(spaceParams(), good); }), "");
  refused([](MapContents& c) { std::swap(c.free_cubes[0], c.free_cubes[1]); });
  refused([](MapContents& c) { c.free_cubes[1] = c.free_cubes[0]; });
  refused([](MapContents& c) { c.free_cubes[0].key.z = -(1 << 20); });
  refused([](MapContents& c) { c.free_cubes[0].cells = {}; });
  refused([](MapContents& c) { c.cell_voxels = 3; });
  refused([](MapContents& c) { c.cell_voxels = 0; });
  refused([](MapContents& c) { std::swap(c.blocks[0], c.blocks[1]); });
  refused([](MapContents& c) { c.blocks[1] = c.blocks[0]; });
  refused([](MapContents& c) { c.blocks[0].key.x = 1 << 20; });
  refused([](MapContents& c) { c.blocks[0].directions = 0; });
  refused([](MapContents& c) { c.blocks[0].directions |= 1u << 6; });
  refused([](MapContents& c) { c.blocks[0].bricks |= uint64_t{1} << 48; });
  refused([](MapContents& c) { c.blocks.pop_back(); });
  refused([](MapContents& c) { c.voxels = PlainArray<uint64_t>(c.voxels.size() - 512); });
  refused([](MapContents& c) { c.colours = PlainArray<uint32_t>(); });
  refused([](MapContents& c) { c.painted = false; });
  refused([](MapContents& c) { c.supporting_frames = c.frames + 1; });
  refused([](MapContents& c) { c.exposure[1] = 0.0f; });
  refused([](MapContents& c) { c.exposure[1] = std::numeric_limits<float>::quiet_NaN(); });
  refused([](MapContents& c) { c.stamp_s = std::numeric_limits<double>::infinity(); });
  refused([](MapContents& c) { c.settings.erase("map/voxel_size_m"); });
  refused([](MapContents& c) { c.settings["fusion/mode"] = std::string("none"); });
}

/// Voxel words are composed bit by bit as in docs/map_format.md.
TEST(Voxels, AreDecodedAsDocumented) {
  const auto word = [](int distance, uint64_t anchor, int evidence, uint64_t weight) {
    return uint64_t{static_cast<uint16_t>(distance)} | anchor << 16 |
           uint64_t{static_cast<uint8_t>(evidence)} << 32 | weight << 40;
  };
  const VoxelValues behind = decodeVoxel(word(-3 * 512, 0xffff, -100, 5 << 14));
  EXPECT_EQ(behind.distance_voxels, -0.75f);
  EXPECT_EQ(behind.evidence, -100);
  EXPECT_EQ(behind.weight, 1.25f);
  const VoxelValues front = decodeVoxel(word(4096, 0, 127, 0xffffff));
  EXPECT_EQ(front.distance_voxels, 2.0f);
  EXPECT_EQ(front.evidence, 127);
  EXPECT_EQ(front.weight, 256.0f - 1.0f / 65536.0f);
  EXPECT_EQ(decodeVoxel(0).weight, 0.0f);
}

}  // namespace
}  // namespace dtsdf
