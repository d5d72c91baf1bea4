// Tests the ground truth for the free-space grid and the comparison of maps with it.
#include <gtest/gtest.h>

#include "dtsdf_mapping/params/mapper_params.h"
#include "evaluation/space_figures.h"

namespace dtsdf {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

MapperParams mapParams(double voxel_m, int cell_voxels, double reach_m) {
  return readMapperParams({{"backend", std::string("cpu")},
                           {"space/enabled", true},
                           {"threads", 2},
                           {"mesh/min_support", 1},  // the ground truth needs only a single view
                           {"map/voxel_size_m", voxel_m},
                           {"space/cell_voxels", cell_voxels},
                           {"space/max_distance_m", reach_m}});
}

std::unique_ptr<Mapper> mapOf(const ViewedScene& viewed, const MapperParams& params) {
  auto mapper = makeMapper(params);
  fuseScene(viewed, *mapper);
  mapper->updateMesh();
  mapper->space()->updateDistances();
  return mapper;
}

/// Keeps one in every `step` views.
ViewedScene thinned(ViewedScene viewed, size_t step) {
  auto& poses_W_C = viewed.views.poses_W_C;
  for (size_t i = 0; i * step < poses_W_C.size(); ++i) poses_W_C[i] = poses_W_C[i * step];
  poses_W_C.resize((poses_W_C.size() + step - 1) / step);
  return viewed;
}

TEST(SpaceTruth, KnowsSolidAndSeenThroughSpace) {
  Scene scene;
  scene.add(makeBox({0, 0, 0}, {2, 0.002, 2}));
  const Views views{{}, {lookAt({0, -2, 0}, {0, 0, 0}, Vector3d::UnitZ())}, {}};
  const SpaceTruth truth({scene, views});
  const auto box = [](double y0, double y1) {
    return AlignedBox3d(Vector3d(0.1, y0, 0.1), Vector3d(0.2, y1, 0.2));
  };
  EXPECT_TRUE(truth.isTaken(box(-0.09, 0.05)));
  EXPECT_FALSE(truth.isTaken(box(-0.09, -0.0015)));
  EXPECT_TRUE(truth.isSeenThrough(box(-0.09, -0.0015), 5.0));
  EXPECT_FALSE(truth.isSeenThrough(box(-0.09, -0.0015), 1.9));
  EXPECT_FALSE(truth.isSeenThrough(box(0.0015, 0.09), 5.0));
  const auto from_front = truth.distanceFrom({0.1, -0.5, 0.1});
  ASSERT_TRUE(from_front);
  EXPECT_NEAR(*from_front, 0.499, 1e-6);
  EXPECT_FALSE(truth.distanceFrom({0.1, 0.5, 0.1}));  // the back is not visible in any view
}

TEST(SpaceFigures, DistinguishTheRightSceneFromAnother) {
  const ViewedScene viewed = thinned(viewedShapes(), 4);
  const MapperParams params = mapParams(0.05, 2, 1.0);
  const auto mapper = mapOf(viewed, params);
  const Space& space = *mapper->space();
  const SpaceTruth truth(viewed);
  const SpaceFigures figures = measureSpace(space, truth, {1.0, 5.0, 500});
  EXPECT_GT(figures.at_middles.count, 300u);
  EXPECT_LT(figures.at_middles.rmse_m, 0.5 * figures.cell_m);
  EXPECT_LT(figures.at_points.rmse_m, 0.5 * figures.cell_m);
  EXPECT_EQ(figures.at_middles.far_off, 0u);
  EXPECT_EQ(figures.taken, 0u);
  EXPECT_EQ(figures.unseen, 0u);
  EXPECT_GT(figures.truly_free, 100u);
  EXPECT_GT(figures.found_free, 0.6 * figures.truly_free);

  // Compared with a different scene, distances are wrong, and some free cells are not free.
  Scene other = viewed.scene;
  other.add(makeBox({0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const SpaceFigures wrong =
      measureSpace(space, SpaceTruth({other, viewed.views}), {1.0, 5.0, 500});
  EXPECT_GT(wrong.taken, 10u);
  EXPECT_GE(wrong.unseen, wrong.taken);
  EXPECT_GT(wrong.at_middles.far_off, 0u);
}

}  // namespace
}  // namespace dtsdf
