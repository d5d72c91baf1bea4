// A tile's blocks and meshes are those of the whole map, to the last bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "kernels/core/grid.h"
#include "mapper/probed_mapper.h"
#include "support/colour_frames.h"
#include "support/depth_frames.h"
#include "support/same_bytes.h"
#include "tiles/colour_reach.h"
#include "tiles/tile.h"
#include "tiles/view_reach.h"

namespace dtsdf {
namespace {

using Blocks = std::map<PackedKey, BlockSnapshot>;
using Meshes = std::map<PackedKey, BlockMesh>;

/// A lap through the room, with a box that stands in it for the first half: what sees its place
/// later clears it, also frames that touch nothing near by.
const std::vector<SceneFrame>& frames() {
  static const std::vector<SceneFrame> rendered = [] {
    Scene with_box = makeRoomScene();
    with_box.add(makeBox({1.6, 1.2, 0.8}, {0.5, 0.5, 0.5}, 0.3));
    const Scene empty = makeRoomScene();
    std::vector<SceneFrame> list;
    for (int i = 0; i < 24; ++i) {
      list.push_back(renderFrame(i < 12 ? with_box : empty, roomCameraPose(2.0 * i), 80, 60));
    }
    return list;
  }();
  return rendered;
}

Blocks blocksOf(ProbedMapper& mapper, const BlockExtent& extent) {
  Blocks blocks;
  for (BlockSnapshot& block : mapper.snapshot()) {
    if (extent.contains(block.key)) blocks[packKey(block.key)] = std::move(block);
  }
  return blocks;
}

Meshes meshesOf(const MeshUpdate& update, const BlockExtent& extent) {
  Meshes meshes;
  for (const BlockMesh& mesh : update.blocks) {
    if (extent.contains(mesh.key) && !mesh.triangles.empty()) meshes[packKey(mesh.key)] = mesh;
  }
  return meshes;
}

bool same(const Blocks& a, const Blocks& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const auto& x, const auto& y) {
           bool equal = x.first == y.first;
           for (int d = 0; d < kDirectionCount; ++d) {
             equal = equal && sameBytes(x.second.voxels[d], y.second.voxels[d]) &&
                     sameBytes(x.second.colours[d], y.second.colours[d]);
           }
           return equal;
         });
}

bool same(const Meshes& a, const Meshes& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const auto& x, const auto& y) {
           return x.first == y.first && sameBytes(x.second.vertices, y.second.vertices) &&
                  sameBytes(x.second.triangles, y.second.triangles) &&
                  sameBytes(x.second.colours, y.second.colours);
         });
}

/// Tiles that cover the room.
std::vector<BlockExtent> tilesOf(const Vec3i& edges) {
  std::vector<BlockExtent> tiles;
  for (int z = -edges.z; z < 12; z += edges.z) {
    for (int y = -2 * edges.y; y < 12; y += edges.y) {
      for (int x = -2 * edges.x; x < 12; x += edges.x) {
        tiles.push_back({{x, y, z}, {x + edges.x - 1, y + edges.y - 1, z + edges.z - 1}});
      }
    }
  }
  return tiles;
}

struct Case {
  FusionMode mode;
  bool directional;
  int refine;
};

class TileMap : public testing::TestWithParam<Case> {
 protected:
  MapperParams params() const {
    MapperParams params = makeCpuParams(GetParam().mode, GetParam().directional, 0.05f, 1);
    params.mesh.refine = GetParam().refine;
    return params;
  }

  std::unique_ptr<ProbedMapper> whole() const {
    auto mapper = makeProbedMapper(params());
    for (const SceneFrame& frame : frames()) mapper->integrate(frame.view());
    return mapper;
  }

  /// A mapper of an extent that is given only the frames that touch it or may see through it.
  std::unique_ptr<ProbedMapper> tile(const BlockExtent& extent) const {
    auto mapper = makeProbedMapper(params());
    mapper->restrictTo({extent, extent, BlockExtent()});
    for (size_t i = 0; i < frames().size(); ++i) {
      const DepthFrame frame = frames()[i].view();
      if (needs(extent, i)) {
        EXPECT_EQ(mapper->integrate(frame).status, FrameStatus::kFused);
        EXPECT_EQ(mapper->stats().refused_blocks, 0u);
        ++fused_;
      } else {
        mapper->passOver({1, 1});
        ++passed_;
      }
    }
    return mapper;
  }

  bool needs(const BlockExtent& extent, size_t frame) const {
    for (const BlockRequest& block : touched(frame)) {
      if (extent.contains(unpackKey(block.key))) return true;
    }
    const double block_m = 0.05 * kBlockSide, margin_m = 6 * 0.05;
    const Eigen::Vector3d first(extent.first.x, extent.first.y, extent.first.z);
    const Eigen::Vector3d end(extent.last.x + 1, extent.last.y + 1, extent.last.z + 1);
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(margin_m);
    return ViewReach(frames()[frame].view(), params())
        .mayPass({first * block_m - margin, end * block_m + margin});
  }

  const std::vector<BlockRequest>& touched(size_t frame) const {
    if (touched_.empty()) {
      const auto mapper = makeProbedMapper(params());
      mapper->restrictTo({noBlocks(), noBlocks(), noBlocks()});
      for (const SceneFrame& each : frames()) {
        mapper->integrate(each.view());
        touched_.push_back(mapper->outsideExtent());
      }
      EXPECT_EQ(mapper->stats().blocks, 0u);
    }
    return touched_[frame];
  }

  mutable std::vector<std::vector<BlockRequest>> touched_;
  mutable size_t fused_ = 0, passed_ = 0;
};

TEST_P(TileMap, BlocksAndMeshesAreThoseOfTheWholeMap) {
  const auto expected = whole();
  const MeshUpdate meshes = expected->updateMesh();
  size_t blocks = 0, with_mesh = 0;
  for (const BlockExtent& own : tilesOf({7, 12, 20})) {
    const BlockExtent wide = withHalo(own);
    const auto mapper = tile(wide);
    const Blocks here = blocksOf(*mapper, wide);
    EXPECT_TRUE(same(here, blocksOf(*expected, wide)));
    EXPECT_EQ(mapper->contents().frames, expected->contents().frames);
    EXPECT_EQ(mapper->stats().blocks, here.size()) << "none outside";
    const Meshes own_meshes = meshesOf(mapper->updateMesh(), own);
    EXPECT_TRUE(same(own_meshes, meshesOf(meshes, own)));
    blocks += here.size();
    with_mesh += own_meshes.size();
  }
  EXPECT_EQ(with_mesh, meshesOf(meshes, BlockExtent()).size()) << "each block in one tile";
  EXPECT_GT(blocks, 300u);
  EXPECT_GT(fused_, 0u);
  EXPECT_GT(passed_, 0u) << "some frames are left out";
}

INSTANTIATE_TEST_SUITE_P(Modes, TileMap,
                         testing::Values(Case{FusionMode::kNormalRayCasting, true, 0},
                                         Case{FusionMode::kNormalRayCasting, true, 1},
                                         Case{FusionMode::kRayCasting, false, 0},
                                         Case{FusionMode::kVoxelProjection, true, 0}),
                         [](const auto& info) {
                           return modeName(info.param.mode, info.param.directional) +
                                  (info.param.refine ? "Refined" : "");
                         });

/// The part of a map that lies in an extent, meshed by itself.
Meshes meshesOfPart(const MapperParams& params, const std::vector<SceneFrame>& list,
                    const BlockExtent& wide, const BlockExtent& own) {
  const auto mapper = makeProbedMapper(params);
  mapper->restrictTo({wide, wide, BlockExtent()});
  for (const SceneFrame& frame : list) mapper->integrate(frame.view());
  return meshesOf(mapper->updateMesh(), own);
}

// A halo that is one block narrower, on either side, is too narrow.
TEST(TileHalo, IsNoWiderThanItHasToBe) {
  const MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.03f, 1);
  const std::vector<SceneFrame> some(frames().begin(), frames().begin() + 6);
  const BlockExtent all;
  const auto whole = makeProbedMapper(params);
  for (const SceneFrame& frame : some) whole->integrate(frame.view());
  const Meshes expected = meshesOf(whole->updateMesh(), all);
  size_t wrong_before = 0, wrong_behind = 0, wrong = 0;
  // Slabs across each axis, a block wide: their faces are everywhere.
  for (int32_t BlockKey::*const axis : {&BlockKey::x, &BlockKey::y, &BlockKey::z}) {
    for (int at = -5; at <= 5; at += 5) {
      BlockExtent own;
      own.first.*axis = own.last.*axis = at;
      const auto differs = [&](int before, int behind) {
        BlockExtent wide = own;
        wide.first.*axis -= before;
        wide.last.*axis += behind;
        Meshes ours;
        for (const auto& [key, mesh] : expected) {
          if (own.contains(mesh.key)) ours[key] = mesh;
        }
        return !same(meshesOfPart(params, some, wide, own), ours);
      };
      wrong += differs(kHaloBefore, kHaloBehind);
      wrong_before += differs(kHaloBefore - 1, kHaloBehind);
      wrong_behind += differs(kHaloBefore, kHaloBehind - 1);
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(wrong_before, 0u);
  EXPECT_GT(wrong_behind, 0u);
}

// The numbers of frames decide when a block comes up to be looked at, and how much support the mesh
// asks for.
TEST(TileFrames, KeepTheirNumbers) {
  const MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.05f, 1);
  const auto counted = makeProbedMapper(params), uncounted = makeProbedMapper(params);
  const auto whole = makeProbedMapper(params);
  const SceneFrame& frame = frames()[0];
  whole->integrate(frames()[15].view());
  whole->integrate(frame.view());
  counted->passOver({1, 1});
  counted->integrate(frame.view());
  uncounted->integrate(frame.view());
  EXPECT_EQ(counted->contents().frames, 2u);
  EXPECT_EQ(counted->contents().supporting_frames, 2u);
  // One of two frames has seen it: mesh/min_support is 2.
  EXPECT_TRUE(counted->updateMesh().blocks.empty());
  EXPECT_FALSE(uncounted->updateMesh().blocks.empty());
}

/// A room with a box in it, which hides its walls from some images and not from others; after each
/// frame an image from beside it.
class TileColours : public testing::Test {
 protected:
  static constexpr double kVoxel_m = 0.05;

  static void SetUpTestSuite() {
    images_ = new std::vector<PaintedFrame>();
    Scene scene = makeRoomScene();
    scene.add(makeBox({1.6, 1.2, 0.8}, {0.5, 0.5, 0.5}, 0.3));
    for (int i = 0; i < 6; ++i) {
      images_->push_back(
          renderColour(scene, wavesAt, besideCamera(roomCameraPose(2.0 * i), 0.1), 80, 60));
    }
  }
  static void TearDownTestSuite() {
    delete images_;
    images_ = nullptr;
  }

  static MapperParams params(float max_depth_m) {
    MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, kVoxel_m, 1);
    params.paint.exposure = ImageExposure::kFixed;
    params.paint.max_depth_m = max_depth_m;
    return params;
  }

  /// A map in which something is painted, of all or of one tile.
  static std::unique_ptr<ProbedMapper> map(const MapperParams& params, const MapExtent& extent,
                                           const BlockExtent& in_view) {
    const ColourReach reach(params, ColourRules());
    auto mapper = makeProbedMapper(params);
    mapper->restrictTo(extent);
    for (size_t i = 0; i < images_->size(); ++i) {
      mapper->integrate(frames()[i].view());
      const ColourFrame image = (*images_)[i].view();
      if (reach.mayPaint(PinholeView(image), in_view)) mapper->paint(image);
    }
    return mapper;
  }

  /// What a tile has to fuse.
  static BlockExtent fusedWith(const MapperParams& params, const BlockExtent& painted) {
    const ColourReach reach(params, ColourRules());
    BlockExtent fused = painted;
    for (const PaintedFrame& frame : *images_) {
      const PinholeView image(frame.view());
      if (reach.mayPaint(image, painted)) fused = around(fused, reach.blocksFor(image, painted));
    }
    return fused;
  }

  static std::vector<PaintedFrame>* images_;
};

std::vector<PaintedFrame>* TileColours::images_ = nullptr;

TEST_F(TileColours, AreThoseOfTheWholeMapWhereItIsKnownWhatHides) {
  const MapperParams params = this->params(3.0f);
  const auto whole = map(params, MapExtent(), BlockExtent());
  EXPECT_GT(whole->stats().colour_bytes, 100000u);
  const MeshUpdate meshes = whole->updateMesh();
  size_t wrong_alone = 0, smaller = 0, painted_tiles = 0;
  for (const BlockExtent& own : tilesOf({4, 6, 10})) {
    if (meshesOf(meshes, own).empty()) continue;
    const BlockExtent painted = withHalo(own), fused = fusedWith(params, painted);
    const auto tile = map(params, {fused, painted, noBlocks()}, painted);
    EXPECT_TRUE(same(blocksOf(*tile, painted), blocksOf(*whole, painted)));
    if (tile->contents().painted) {
      EXPECT_TRUE(same(meshesOf(tile->updateMesh(), own), meshesOf(meshes, own)));
      ++painted_tiles;
    }
    smaller += fused.first.x > -8 || fused.last.x < 7;
    if (wrong_alone > 0) continue;
    const auto alone = map(params, {painted, painted, noBlocks()}, painted);
    wrong_alone += !same(blocksOf(*alone, painted), blocksOf(*whole, painted));
  }
  EXPECT_GT(painted_tiles, 5u);
  EXPECT_GT(wrong_alone, 0u) << "what is not fused hides nothing";
  EXPECT_GT(smaller, 0u) << "and not all is fused";
}

// What lies beyond the depth is neither painted nor in the way.
TEST_F(TileColours, ReachNoFartherThanAsked) {
  size_t bytes = 0;
  for (const float max_depth_m : {1.2f, 2.0f, 0.0f}) {
    const auto mapper = map(params(max_depth_m), MapExtent(), BlockExtent());
    EXPECT_GT(mapper->stats().colour_bytes, bytes) << max_depth_m;
    bytes = mapper->stats().colour_bytes;
  }
}

TEST_F(TileColours, ExposureIsOneWhereItIsFixed) {
  std::vector<uint8_t> dark = images_->front().pixels;
  for (uint8_t& channel : dark) channel = static_cast<uint8_t>(channel / 2);
  ColourFrame darker = images_->front().view();
  darker.data = dark.data();
  for (const bool is_fixed : {true, false}) {
    MapperParams params = this->params(0.0f);
    if (!is_fixed) params.paint.exposure = ImageExposure::kAdaptive;
    params.mesh.min_support = 1;
    const auto mapper = makeProbedMapper(params);
    mapper->integrate(frames()[0].view());
    mapper->paint(images_->front().view());
    mapper->paint(darker);
    for (const float gain : mapper->contents().exposure) {
      if (is_fixed) {
        EXPECT_EQ(gain, 1.0f);
      } else {
        EXPECT_NEAR(gain, 2.0f, 0.05f);
      }
    }
  }
}

}  // namespace
}  // namespace dtsdf
