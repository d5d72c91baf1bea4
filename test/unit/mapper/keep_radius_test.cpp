// Tests that blocks beyond map/keep_radius_m, and no others, are dropped from a map.
#include <gtest/gtest.h>

#include <cmath>

#include "backend/frame_check.h"
#include "dtsdf_mapping/params/param_set.h"
#include "support/block_snapshot.h"
#include "support/map_equality.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr float kKeptVoxel_m = 0.04f, kKeptRadius_m = 3.0f;

MapperParams params(float keep_radius_m) {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, kKeptVoxel_m);
  params.fusion.max_depth_m = 2.5f;
  params.map.keep_radius_m = keep_radius_m;
  return params;
}

/// A view of a wall that runs along x, from a camera at `x`.
SceneFrame lookFrom(double x, int width = 80) {
  Scene scene;
  scene.add(Plane{{0.0, 1.5, 0.0}, -Vector3d::UnitY()});
  return renderFrame(scene, lookAt({x, 0.0, 0.0}, {x, 1.0, 0.0}, Vector3d::UnitZ()), width,
                     3 * width / 4);
}

double distanceOf(const BlockKey& block, const Vector3d& p_W) {
  const double edge = kBlockSide * static_cast<double>(kKeptVoxel_m);
  const Vector3d low = edge * Vector3d(block.x, block.y, block.z);
  return Eigen::AlignedBox3d(low, low + Vector3d::Constant(edge)).exteriorDistance(p_W);
}

/// After a walk along the wall, the map equals an unlimited map from which the blocks beyond the
/// radius have been removed.
TEST(KeepRadius, KeepsExactlyTheBlocksItReaches) {
  Session all(params(0.0f)), near(params(kKeptRadius_m));
  double x = 0.0;
  for (int i = 0; i < 60; ++i, x += 0.1) {
    const SceneFrame frame = lookFrom(x);
    all.integrate(frame);
    near.integrate(frame);
    if (i % 4 == 0) near.updateMesh();
  }
  const Vector3d camera(x - 0.1, 0.0, 0.0);
  size_t kept = 0, dropped = 0;
  std::vector<BlockSnapshot> rest = snapshotOf(near.mapper());
  for (const BlockSnapshot& block : snapshotOf(all.mapper())) {
    if (distanceOf(block.key, camera) > kKeptRadius_m) {
      ++dropped;
      continue;
    }
    ASSERT_LT(kept, rest.size());
    ASSERT_TRUE(block.key == rest[kept].key);
    for (int d = 0; d < kDirectionCount; ++d) {
      ASSERT_EQ(block.voxels[d].size(), rest[kept].voxels[d].size());
      for (size_t i = 0; i < block.voxels[d].size(); ++i) {
        ASSERT_EQ(block.voxels[d][i].state, rest[kept].voxels[d][i].state);
      }
    }
    ++kept;
  }
  EXPECT_EQ(kept, rest.size());
  EXPECT_GT(kept, 50u);
  EXPECT_GT(dropped, 50u);
  EXPECT_EQ(near.mapper().stats().dropped_blocks, dropped);
  EXPECT_EQ(all.mapper().stats().dropped_blocks, 0u);
  near.updateMesh();
  EXPECT_EQ(near.mapper().stats().blocks, kept) << "the entries of dropped blocks should be freed";
  for (const Vec3f& p : near.mesh().vertices_m) {
    ASSERT_LT((Vector3d(p.x, p.y, p.z) - camera).norm(), kKeptRadius_m + 1.75 * 8 * kKeptVoxel_m);
  }
  near.mapper().clear();
  EXPECT_EQ(near.mapper().stats().dropped_blocks, 0u);
}

/// The meshes of dropped blocks are removed. Meshing after every frame or once at the end gives the
/// same mesh.
TEST(KeepRadius, MeshesOfDroppedBlocksAreRemoved) {
  Session often(params(kKeptRadius_m)), once(params(kKeptRadius_m));
  for (int i = 0; i < 40; ++i) {
    const SceneFrame frame = lookFrom(0.2 * i);
    often.integrate(frame);
    once.integrate(frame);
    often.updateMesh();
  }
  once.updateMesh();
  EXPECT_TRUE(sameMaps(often.mapper(), once.mapper()));
  EXPECT_TRUE(sameMeshes(often.mesh(), once.mesh()));
  EXPECT_GT(once.mesh().triangles.size(), 100u);
}

/// A long flight passes far more blocks than fit into the budget, but no blocks are refused,
/// whether meshes are updated all the time, never, or only at first.
TEST(KeepRadius, BoundsMemoryOnLongFlights) {
  for (const int meshed_frames : {0, 40, 1000}) {
    MapperParams settings = params(kKeptRadius_m);
    settings.map.max_memory_mb = 3;
    Session session(settings);
    size_t most = 0;
    for (int i = 0; i < 200; ++i) {
      session.integrate(lookFrom(0.4 * i, 40));
      if (i < meshed_frames) session.updateMesh();
      most = std::max(most, session.mapper().stats().map_bytes);
    }
    const MapStats stats = session.mapper().stats();
    EXPECT_EQ(stats.refused_blocks, 0u) << meshed_frames;
    constexpr size_t kMinOfABlock = BlockTable::kBlockBytes + BlockTable::kArrayBytes;
    EXPECT_GT(stats.dropped_blocks * kMinOfABlock, size_t(6) << 20);
    EXPECT_LT(most, size_t(3) << 20);
  }
}

/// Blocks may be kept around a point other than the camera.
TEST(KeepRadius, UsesTheCentreGivenByAFrame) {
  Session session(params(kKeptRadius_m));
  session.integrate(lookFrom(0.0));
  SceneFrame away = lookFrom(20.0);
  away.frame.keep_center_W = Vector3d::Zero();
  session.integrate(away);
  const Vector3d origin = Vector3d::Zero();
  EXPECT_GT(snapshotOf(session.mapper()).size(), 20u);
  for (const BlockSnapshot& block : snapshotOf(session.mapper())) {
    ASSERT_LE(distanceOf(block.key, origin), kKeptRadius_m);
  }
  away.frame.keep_center_W = Vector3d(0.0, std::nan(""), 0.0);
  EXPECT_EQ(session.mapper().integrate(away.view()).status, FrameStatus::kBadPose);
}

TEST(KeepRadius, RefusedFramesDropNothing) {
  Session session(params(kKeptRadius_m));
  session.integrate(lookFrom(0.0));
  SceneFrame empty = lookFrom(20.0);
  empty.depth_m.assign(empty.depth_m.size(), 0.0f);
  EXPECT_EQ(session.mapper().integrate(empty.view()).status, FrameStatus::kNoMeasurement);
  EXPECT_EQ(session.mapper().stats().dropped_blocks, 0u);
}

TEST(KeepRadius, MustCoverTheMappedDepth) {
  try {
    readMapperParams({{"map/keep_radius_m", 5.0}});
    FAIL();
  } catch (const ParamError& error) {
    EXPECT_NE(std::string(error.what()).find("fusion/max_depth_m"), std::string::npos);
  }
  EXPECT_EQ(readMapperParams({{"map/keep_radius_m", 10}}).map.keep_radius_m, 10.0f);
}

}  // namespace
}  // namespace dtsdf
