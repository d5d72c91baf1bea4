// Tests properties that every map must have, with random scenes, cameras and settings.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "mapper/probed_mapper.h"
#include "meshing/mesh_stream.h"
#include "support/block_snapshot.h"
#include "support/depth_frames.h"
#include "support/map_equality.h"
#include "support/mesh_topology.h"
#include "support/random_seed.h"
#include "support/raw_mesh.h"
#include "support/same_bytes.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

struct RandomCase {
  Scene scene;
  MapperParams params;
  std::vector<SceneFrame> frames;
};

class Draw {
 public:
  explicit Draw(uint32_t seed) : random_(seed) {}

  double number(double low, double high) { return low + (high - low) * (random_() / 4294967296.0); }
  int whole(int count) { return static_cast<int>(random_() % static_cast<uint32_t>(count)); }
  Vector3d point(double reach) {
    const double x = number(-reach, reach), y = number(-reach, reach);
    return Vector3d(x, y, number(-reach, reach));
  }

 private:
  std::mt19937 random_;
};

Scene drawScene(Draw& draw, const Vector3d& centre) {
  Scene scene;
  const int count = 1 + draw.whole(4);
  for (int i = 0; i < count; ++i) {
    const Vector3d at = centre + draw.point(0.4);
    switch (draw.whole(3)) {
      case 0: scene.add(Sphere{at, draw.number(0.1, 0.4)}); break;
      case 1:
        scene.add(makeBox(at, Vector3d::Constant(0.05) + draw.point(0.5).cwiseAbs(),
                          draw.number(0.0, 3.0)));
        break;
      default:
        scene.add(Rod{at, at + Vector3d::Constant(0.1) + draw.point(0.5).cwiseAbs(),
                      draw.number(0.02, 0.2)});
    }
  }
  return scene;
}

/// Adds noise that grows with the square of depth, and holes.
void spoil(Draw& draw, SceneFrame& frame) {
  for (float& z : frame.depth_m) {
    z += static_cast<float>(draw.number(-0.002, 0.002)) * z * z;
    if (draw.whole(50) == 0) z = std::nanf("");
  }
}

RandomCase drawCase(uint32_t seed) {
  Draw draw(seed);
  RandomCase result;
  const FusionMode modes[] = {FusionMode::kVoxelProjection, FusionMode::kRayCasting,
                              FusionMode::kNormalRayCasting};
  result.params = makeCpuParams(modes[draw.whole(3)], draw.whole(2) == 0,
                                static_cast<float>(draw.number(0.02, 0.06)), 2);
  result.params.map.truncation_voxels = static_cast<float>(draw.number(1.0, 6.0));
  const Vector3d centre = draw.point(draw.whole(2) == 0 ? 1.0 : 500.0);
  result.scene = drawScene(draw, centre);
  for (int i = 0; i < 5; ++i) {
    const Vector3d eye = centre + draw.number(1.2, 2.5) * (draw.point(1.0).normalized());
    const auto pose = lookAt(eye, centre + draw.point(0.2), Vector3d(0.1, 0.9, 0.3));
    result.frames.push_back(
        renderFrame(result.scene, pose, 64 + draw.whole(64), 48 + draw.whole(48)));
    spoil(draw, result.frames.back());
  }
  return result;
}

class RandomScenes : public testing::TestWithParam<int> {
 protected:
  uint32_t seed() const { return caseSeed(GetParam()); }
};

/// Updating the mesh after most frames, on one thread, gives the same mesh as updating it once, on
/// two threads. A frame before clear() makes no difference.
TEST_P(RandomScenes, WorkMayBeSplitInAnyWay) {
  SCOPED_TRACE(describeSeed(seed()));
  RandomCase c = drawCase(seed());
  const std::unique_ptr<ProbedMapper> whole = makeProbedMapper(c.params);
  c.params.threads = 1;
  const std::unique_ptr<ProbedMapper> pieces = makeProbedMapper(c.params);
  pieces->integrate(c.frames.back().view());
  pieces->updateMesh();
  pieces->clear();
  MeshStore whole_mesh(c.params.map.voxel_size_m), pieces_mesh(c.params.map.voxel_size_m);
  Draw draw(seed() + 1000000);
  for (const SceneFrame& frame : c.frames) {
    EXPECT_EQ(whole->integrate(frame.view()).status, pieces->integrate(frame.view()).status);
    if (draw.whole(3) > 0) pieces_mesh.apply(pieces->updateMesh());
  }
  pieces_mesh.apply(pieces->updateMesh());
  whole_mesh.apply(whole->updateMesh());
  EXPECT_TRUE(sameMaps(*whole, *pieces));
  EXPECT_TRUE(sameMeshes(whole_mesh.assemble(), pieces_mesh.assemble()));
}

TEST_P(RandomScenes, MeshesAreSound) {
  SCOPED_TRACE(describeSeed(seed()));
  const RandomCase c = drawCase(seed());
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(c.params);
  for (const SceneFrame& frame : c.frames) mapper->integrate(frame.view());
  MeshStore store(c.params.map.voxel_size_m);
  store.apply(mapper->updateMesh());
  const Mesh mesh = store.assemble();
  const MeshTopology topology = measureTopology(mesh);
  const MeshTopology raw = measureTopology(rawMesh(store));
  EXPECT_GT(raw.triangles, 0u);
  EXPECT_EQ(raw.triangles, store.triangleCount());
  EXPECT_LE(topology.boundary_edges, raw.boundary_edges);
  EXPECT_EQ(topology.inconsistent_edges, raw.inconsistent_edges);
  EXPECT_EQ(topology.repeated_corners, 0u) << topology;
  EXPECT_EQ(topology.unused_vertices, 0u) << topology;
  for (const Vec3f& n : mesh.normals) ASSERT_NEAR(norm(n), 1.0f, 1e-4f);

  Mesh in_pieces;
  BlockExtent bounds = noBlocks();
  for (const auto& [key, block] : store.blocks()) bounds = around(bounds, {block->key, block->key});
  MeshStream stream(c.params.map.voxel_size_m, false, bounds,
                    {[&](const Mesh& piece) {
                       for (const Vec3f& p : piece.vertices_m) in_pieces.vertices_m.push_back(p);
                     },
                     [&](const auto& t) { in_pieces.triangles.push_back(t); }},
                    1);
  for (const auto& [key, block] : store.blocks()) stream.add(*block);
  stream.finish();
  EXPECT_TRUE(sameBytes(in_pieces.vertices_m, mesh.vertices_m));
  EXPECT_EQ(in_pieces.triangles, mesh.triangles);
}

/// No distance exceeds the truncation distance; no weight or evidence counter exceeds what five
/// frames can add. Empty voxels have the distance 0.
TEST_P(RandomScenes, SamplesStayWithinTheirBounds) {
  SCOPED_TRACE(describeSeed(seed()));
  const RandomCase c = drawCase(seed());
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(c.params);
  for (const SceneFrame& frame : c.frames) mapper->integrate(frame.view());
  const float truncation = c.params.map.truncation_voxels;
  for (const BlockSnapshot& block : snapshotOf(*mapper)) {
    for (const auto& voxels : block.voxels) {
      for (const Voxel& voxel : voxels) {
        ASSERT_LE(std::abs(sdfOf(voxel)), truncation + 1.0f / 2048.0f);
        ASSERT_LE(weightOf(voxel), 5.0f);  // in frames
        ASSERT_LE(evidenceOf(voxel), 15);
        if (isEmpty(voxel)) {
          ASSERT_EQ(sdfOf(voxel), 0.0f);
        } else {
          ASSERT_GT(weightUnits(voxel), 0u);
        }
      }
    }
  }
}

/// Regions are cleared between frames. Updating the mesh after each region gives the same mesh as
/// updating it once at the end. Clearing everything empties the map.
TEST_P(RandomScenes, RegionsMayBeClearedAtAnyTime) {
  SCOPED_TRACE(describeSeed(seed()));
  const RandomCase c = drawCase(seed());
  const std::unique_ptr<ProbedMapper> often = makeProbedMapper(c.params);
  const std::unique_ptr<ProbedMapper> once = makeProbedMapper(c.params);
  MeshStore often_mesh(c.params.map.voxel_size_m), once_mesh(c.params.map.voxel_size_m);
  Draw draw(seed() + 2000000);
  for (const SceneFrame& frame : c.frames) {
    often->integrate(frame.view());
    once->integrate(frame.view());
    if (draw.whole(3) > 0) often->beginMeshUpdate();
    const Vector3d eye = frame.frame.T_W_C.translation();
    const Vector3d at = frame.frame.T_W_C * Vector3d(0.0, 0.0, draw.number(0.8, 2.0));
    BoxRegion box;
    box.T_W_B = lookAt(at, eye, Vector3d(0.1, 0.9, 0.3));
    box.size_m = {draw.number(0.1, 1.0), draw.number(0.1, 1.0), draw.number(0.1, 1.0)};
    const SphereRegion sphere{at, draw.number(0.05, 0.6)};
    const Region region = draw.whole(2) == 0 ? Region(box) : Region(sphere);
    const ClearedRegion cleared = often->clearRegion(region);
    const ClearedRegion same = once->clearRegion(region);
    EXPECT_EQ(cleared.voxels, same.voxels);
    EXPECT_EQ(cleared.blocks, same.blocks);
    often_mesh.apply(often->finishMeshUpdate());
  }
  often_mesh.apply(often->updateMesh());
  once_mesh.apply(once->updateMesh());
  EXPECT_TRUE(sameMaps(*often, *once));
  EXPECT_TRUE(sameMeshes(often_mesh.assemble(), once_mesh.assemble()));

  const size_t blocks = snapshotOf(*often).size();
  EXPECT_EQ(often->clearRegion(SphereRegion{Vector3d::Zero(), 1e5}).blocks, blocks);
  often_mesh.apply(often->updateMesh());
  EXPECT_EQ(often_mesh.triangleCount(), 0u);
  EXPECT_EQ(often->stats().map_bytes, 0u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomScenes, testing::Range(0, 20));

}  // namespace
}  // namespace dtsdf
