// Tests that a follower of a map's free-space grid returns the same query results as the map.
#include "space/space_follower.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <tuple>

#include "support/depth_frames.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;
using Key = std::tuple<int32_t, int32_t, int32_t>;

constexpr double kMaxDistance_m = 0.6;

MapperParams followedParams() {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true);
  params.threads = 1;
  params.space.enabled = true;
  params.space.cell_voxels = 2;
  params.space.max_distance_m = static_cast<float>(kMaxDistance_m);
  params.space.max_range_m = 3.5f;
  params.mesh.min_support = 1;
  return params;
}

std::map<Key, SpaceCube> byFirstCell(const std::vector<SpaceCube>& cubes) {
  std::map<Key, SpaceCube> sorted;
  for (const SpaceCube& cube : cubes) sorted[{cube.first.x, cube.first.y, cube.first.z}] = cube;
  return sorted;
}

void expectSameCubes(const std::vector<SpaceCube>& a, const std::vector<SpaceCube>& b) {
  EXPECT_EQ(a.size(), b.size());
  const auto left = byFirstCell(a), right = byFirstCell(b);
  ASSERT_EQ(left.size(), right.size());
  for (const auto& [key, cube] : left) {
    const auto other = right.find(key);
    ASSERT_NE(other, right.end());
    EXPECT_EQ(cube.free, other->second.free);
    EXPECT_EQ(cube.surface, other->second.surface);
  }
}

/// Points in and around the scene, and two points that cannot be in any map.
std::vector<Vector3d> somePoints(size_t count) {
  std::mt19937 random(caseSeed(0));
  std::uniform_real_distribution<double> any(-2.4, 2.4);
  std::vector<Vector3d> points{{1e300, 0.0, 0.0}, {0.0, std::nan(""), 0.0}};
  while (points.size() < count) points.emplace_back(any(random), any(random), any(random));
  return points;
}

void expectSameAnswers(const KnownSpace& map, const KnownSpace& follower) {
  EXPECT_EQ(map.cellSize_m(), follower.cellSize_m());
  for (const Vector3d& p : somePoints(4000)) {
    const SpaceDistance a = map.distanceAt(p), b = follower.distanceAt(p);
    ASSERT_EQ(a.known, b.known) << p.transpose();
    ASSERT_EQ(a.distance_m, b.distance_m) << p.transpose();
    ASSERT_EQ(a.gradient.x, b.gradient.x);
    ASSERT_EQ(a.gradient.y, b.gradient.y);
    ASSERT_EQ(a.gradient.z, b.gradient.z);
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 10.0) continue;
    const Vec3i cell = map.cellAt(p);
    ASSERT_EQ(map.stateOf(cell), follower.stateOf(cell));
    ASSERT_EQ(map.squaredDistance(cell), follower.squaredDistance(cell));
  }
  expectSameCubes(map.cubes(-3, 12), follower.cubes(-3, 12));
}

class SpaceFollowerTest : public ::testing::Test {
 protected:
  void fuse(double from_x, double to_x) {
    mapper_->integrate(
        renderFrame(makeBallRoom(),
                    lookAt(Vector3d(from_x, 0.8, 0.1), Vector3d(to_x, 0.0, 0.0), Vector3d::UnitZ()))
            .view());
  }

  void follow() {
    mapper_->updateMesh();
    follower_.apply(mapper_->space()->takeChanges(), mapper_->space()->cellSize_m());
    mapper_->space()->updateDistances();
  }

  std::unique_ptr<Mapper> mapper_ = makeMapper(followedParams());
  SpaceFollower follower_{kMaxDistance_m, 2};
};

TEST_F(SpaceFollowerTest, KnowsWhatTheMapKnows) {
  EXPECT_TRUE(follower_.snapshot()->isEmpty());
  EXPECT_FALSE(follower_.snapshot()->distanceAt(Vector3d::Zero()).known);
  fuse(-1.2, 1.0);
  follow();
  EXPECT_FALSE(follower_.snapshot()->isEmpty());
  expectSameAnswers(*mapper_->space(), *follower_.snapshot());
  fuse(1.2, -1.0);
  fuse(0.2, -0.2);
  follow();
  expectSameAnswers(*mapper_->space(), *follower_.snapshot());
  mapper_->clearRegion(SphereRegion{{0.3, 0.1, 0.0}, 0.6});
  follow();
  expectSameAnswers(*mapper_->space(), *follower_.snapshot());
  mapper_->clear();
  follow();
  EXPECT_TRUE(follower_.snapshot()->isEmpty());
  expectSameAnswers(*mapper_->space(), *follower_.snapshot());
}

/// A snapshot does not change when the follower is updated.
TEST_F(SpaceFollowerTest, SnapshotsDoNotChange) {
  fuse(-1.2, 1.0);
  follow();
  const auto before = follower_.snapshot();
  const std::vector<SpaceCube> cubes = before->cubes(-1000, 1000);
  const Vector3d p(0.0, 0.6, 0.0);
  const SpaceDistance distance = before->distanceAt(p);
  ASSERT_TRUE(distance.known);
  fuse(1.2, -1.0);
  mapper_->clearRegion(SphereRegion{{0.3, 0.1, 0.0}, 0.6});
  follow();
  EXPECT_NE(follower_.snapshot()->distanceAt(p).distance_m, distance.distance_m);
  expectSameCubes(before->cubes(-1000, 1000), cubes);
  EXPECT_EQ(before->distanceAt(p).distance_m, distance.distance_m);
}

TEST_F(SpaceFollowerTest, FollowsAMapWithAnotherCellSize) {
  fuse(-1.2, 1.0);
  follow();
  MapperParams params = followedParams();
  params.map.voxel_size_m *= 1.5f;
  mapper_ = makeMapper(params);
  fuse(1.2, -1.0);
  follow();
  expectSameAnswers(*mapper_->space(), *follower_.snapshot());
}

/// The map drops cells far from the camera, and so does the follower.
TEST_F(SpaceFollowerTest, ForgetsDroppedSpace) {
  MapperParams params = followedParams();
  params.fusion.max_depth_m = 3.0f;
  params.map.keep_radius_m = 3.0f;
  mapper_ = makeMapper(params);
  for (int i = 0; i < 6; ++i) {
    Scene scene;
    scene.add(Room{Vector3d(-1.49 + 2 * i, -1.18, -0.97), Vector3d(1.51 + 2 * i, 1.22, 1.03)});
    const Vector3d eye(2.0 * i, 0.3, 0.2);
    mapper_->integrate(
        renderFrame(scene, lookAt(eye, eye + Vector3d::UnitX(), Vector3d::UnitZ())).view());
    follow();
    expectSameCubes(mapper_->space()->cubes(-1000, 1000), follower_.snapshot()->cubes(-1000, 1000));
  }
  ASSERT_FALSE(follower_.snapshot()->isEmpty());
  for (const SpaceCube& cube : follower_.snapshot()->cubes(-1000, 1000)) {
    EXPECT_GT(cube.first.x * mapper_->space()->cellSize_m(), 1.0);
  }
}

}  // namespace
}  // namespace dtsdf
