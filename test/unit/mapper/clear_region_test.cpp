// Tests that clearing a region empties exactly the voxels inside it, and that clearing the map
// leaves it empty.
#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

#include "support/block_snapshot.h"
#include "support/colour_frames.h"
#include "support/map_equality.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr float kRegionVoxel_m = 0.02f;

/// A ball in front of a wall.
Scene ballAndWall() {
  Scene scene;
  scene.add(Plane{{1.6, 0.0, 0.0}, -Vector3d::UnitX()});
  scene.add(Sphere{{1.1, 0.0, 0.0}, 0.2});
  return scene;
}

const std::vector<SceneFrame>& frames() {
  static std::vector<SceneFrame> frames;
  if (!frames.empty()) return frames;
  std::vector<Eigen::Isometry3d> poses;
  for (const double y : {-0.3, 0.0, 0.3, -0.2, 0.2}) {
    poses.push_back(lookAt({0.0, y, 0.1}, {1.2, 0.0, 0.0}, Vector3d::UnitZ()));
  }
  frames = renderFrames(ballAndWall(), poses);
  return frames;
}

void seeAll(Session& session) {
  for (const SceneFrame& frame : frames()) session.integrate(frame);
}

struct RegionCase {
  std::string name;
  Region region;
};

BoxRegion tiltedBox() {
  BoxRegion box;
  box.T_W_B = Eigen::Translation3d(1.3, 0.05, 0.0) *
              Eigen::AngleAxisd(0.6, Vector3d(1.0, 2.0, -1.0).normalized());
  box.size_m = {0.7, 0.25, 0.4};
  return box;
}

bool isIn(const Region& region, const Vector3d& p_W) {
  if (const auto* sphere = std::get_if<SphereRegion>(&region)) {
    return (p_W - sphere->center_W).norm() <= sphere->radius_m;
  }
  const auto& box = std::get<BoxRegion>(region);
  const Vector3d p_B = (box.T_W_B.inverse() * p_W).cwiseAbs();
  return (p_B.array() <= 0.5 * box.size_m.array()).all();
}

Vector3d positionOf(const BlockKey& block, int voxel) {
  const Vec3i at = firstVoxelOfBlock(block) + voxelOffset(voxel);
  return static_cast<double>(kRegionVoxel_m) * Vector3d(at.x, at.y, at.z);
}

class ClearRegion : public testing::TestWithParam<RegionCase> {
 protected:
  MapperParams params() const {
    return makeCpuParams(FusionMode::kNormalRayCasting, true, kRegionVoxel_m);
  }
};

/// Voxels inside the region are empty, voxels outside are unchanged, and the removed voxels are
/// counted.
TEST_P(ClearRegion, EmptiesExactlyTheVoxelsInside) {
  Session session(params());
  seeAll(session);
  const std::vector<BlockSnapshot> before = snapshotOf(session.mapper());
  const size_t arrays_before = session.mapper().stats().voxel_arrays;
  const ClearedRegion cleared = session.mapper().clearRegion(GetParam().region);
  std::map<PackedKey, BlockSnapshot> after;
  for (BlockSnapshot& block : snapshotOf(session.mapper())) {
    after.emplace(packKey(block.key), std::move(block));
  }
  size_t emptied = 0, kept = 0, arrays = 0;
  for (const BlockSnapshot& block : before) {
    const auto found = after.find(packKey(block.key));
    for (int d = 0; d < kDirectionCount; ++d) {
      const bool is_there = found != after.end() && !found->second.voxels[d].empty();
      bool holds = false;
      for (size_t i = 0; i < block.voxels[d].size(); ++i) {
        const Voxel& voxel = block.voxels[d][i];
        const bool inside = isIn(GetParam().region, positionOf(block.key, static_cast<int>(i)));
        const Voxel now = is_there ? found->second.voxels[d][i] : Voxel{};
        // An array without distances is removed, with its evidence of free space.
        const bool is_gone = inside || (!is_there && isEmpty(voxel));
        const Voxel expected = is_gone ? Voxel{} : voxel;
        ASSERT_EQ(now.state, expected.state);
        ASSERT_EQ(now.sdf_units, expected.sdf_units);
        ASSERT_EQ(now.anchor, expected.anchor);
        if (isEmpty(voxel)) continue;
        ++(inside ? emptied : kept);
        holds = holds || !inside;
      }
      EXPECT_EQ(is_there, holds) << "only arrays that still hold distances should be kept";
      arrays += holds;
    }
  }
  EXPECT_GT(emptied, 300u);
  EXPECT_GT(kept, 300u);
  EXPECT_EQ(cleared.voxels, emptied);
  EXPECT_EQ(cleared.blocks, before.size() - after.size());
  EXPECT_EQ(session.mapper().stats().voxel_arrays, arrays);
  EXPECT_LT(arrays, arrays_before);
  const ClearedRegion again = session.mapper().clearRegion(GetParam().region);
  EXPECT_EQ(again.voxels + again.blocks, 0u);
}

INSTANTIATE_TEST_SUITE_P(Regions, ClearRegion,
                         testing::Values(RegionCase{"Sphere", SphereRegion{{1.1, 0.0, 0.0}, 0.33}},
                                         RegionCase{"TiltedBox", tiltedBox()}),
                         [](const testing::TestParamInfo<RegionCase>& info) {
                           return info.param.name;
                         });

TEST(Clear, LeavesAnEmptyMap) {
  Session session(makeCpuParams());
  seeAll(session);
  session.mapper().clear();
  EXPECT_FALSE(session.mapper().isMeshMade());
  EXPECT_EQ(session.mapper().stats().blocks, 0u);
  EXPECT_TRUE(session.mapper().updateMesh().blocks.empty());
}

TEST(ClearRegionOfAPaintedMap, RemovesColoursInside) {
  Session session(makeCpuParams());
  seeAll(session);
  const PaintedFrame image = renderColour(
      ballAndWall(),
      [](const Vector3d&) {
        return Colour{200, 100, 50};
      },
      frames()[0].frame.T_W_C);
  session.mapper().paint(image.view());
  const SphereRegion ball{{1.1, 0.0, 0.0}, 0.3};
  session.mapper().clearRegion(ball);
  seeAll(session);
  size_t painted = 0, unpainted = 0;
  for (const BlockSnapshot& block : snapshotOf(session.mapper())) {
    for (int d = 0; d < kDirectionCount; ++d) {
      for (size_t i = 0; i < block.voxels[d].size(); ++i) {
        const bool is_painted = !block.colours[d].empty() && isPainted(block.colours[d][i]);
        const bool inside = isIn(ball, positionOf(block.key, static_cast<int>(i)));
        ASSERT_FALSE(inside && is_painted);
        painted += is_painted;
        unpainted += inside && !isEmpty(block.voxels[d][i]);
      }
    }
  }
  EXPECT_GT(painted, 100u);
  EXPECT_GT(unpainted, 100u);
}

TEST(ClearBadRegion, ThrowsAndChangesNothing) {
  Session session(makeCpuParams()), untouched(makeCpuParams());
  seeAll(session);
  seeAll(untouched);
  EXPECT_THROW(session.mapper().clearRegion(SphereRegion{{1.1, 0.0, 0.0}, -1.0}),
               std::invalid_argument);
  EXPECT_THROW(session.mapper().clearRegion(BoxRegion()), std::invalid_argument);
  EXPECT_THROW(session.mapper().clearRegion(SphereRegion{{1.1, std::nan(""), 0.0}, 1.0}),
               std::invalid_argument);
  EXPECT_TRUE(sameMaps(session.mapper(), untouched.mapper()));
}

}  // namespace
}  // namespace dtsdf
