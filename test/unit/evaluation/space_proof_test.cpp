// What the space layer is held to: the truth about it, the figures, and ways past a thin plate.
#include <gtest/gtest.h>

#include "evaluation/path_search.h"
#include "evaluation/seen_surface.h"
#include "evaluation/shared_options.h"
#include "evaluation/space_figures.h"
#include "evaluation/space_scenes.h"
#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

MapperParams mapParams(double voxel_m, int cell_voxels, double reach_m) {
  return spaceParams({{"backend", std::string("cpu")},
                      {"threads", 2},
                      {"mesh/min_support", 1},  // as the truth counts what one view shows
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

/// Every so-manieth view of a scene.
ViewedScene thinned(ViewedScene viewed, size_t step) {
  auto& poses_W_C = viewed.views.poses_W_C;
  for (size_t i = 0; i * step < poses_W_C.size(); ++i) poses_W_C[i] = poses_W_C[i * step];
  poses_W_C.resize((poses_W_C.size() + step - 1) / step);
  return viewed;
}

TEST(MeshSceneBox, IsReachedIntoByWhatHasAPointInIt) {
  const MeshScene scene(makeRectangle(-1, -1, 1, 1, 0));
  const auto reaches = [&](const Vector3d& low, const Vector3d& high) {
    return scene.reachesInto(AlignedBox3d(low, high));
  };
  EXPECT_TRUE(reaches({0.1, 0.1, -0.1}, {0.2, 0.2, 0.1}));
  EXPECT_TRUE(reaches({-3, -3, -3}, {3, 3, 3}));  // it lies wholly inside
  EXPECT_FALSE(reaches({0.1, 0.1, 0.001}, {0.2, 0.2, 0.1}));
  EXPECT_FALSE(reaches({1.001, -1, -1}, {2, 1, 1}));
  // Near the slanted side of one triangle, with bounds that overlap.
  TriangleMesh triangle = makeRectangle(-1, -1, 1, 1, 0);
  triangle.triangles.resize(1);  // (-1, -1), (1, -1), (1, 1)
  const MeshScene half(triangle);
  const Vector3d low(-0.9, 0.5, -0.1);
  EXPECT_FALSE(half.reachesInto(AlignedBox3d(low, Vector3d(0.4, 0.9, 0.1))));
  EXPECT_TRUE(half.reachesInto(AlignedBox3d(low, Vector3d(0.6, 0.9, 0.1))));
}

double areaOf(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const double a : triangleAreas(mesh)) area += a;
  return area;
}

TEST(SeenSurface, IsWhatNoOtherSurfaceHides) {
  TriangleMesh mesh = makeRectangle(-2, -2, 2, 2, 0);
  addQuad(mesh, {-0.5f, -0.5f, 1}, {0.5f, -0.5f, 1}, {0.5f, 0.5f, 1}, {-0.5f, 0.5f, 1});
  const TriangleMesh fine = cutFinely(mesh, 0.05f);
  EXPECT_NEAR(areaOf(fine), 17.0, 1e-3);
  for (const auto& t : fine.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_LE((fine.vertices[t[i]] - fine.vertices[t[(i + 1) % 3]]).norm(), 0.05f);
    }
  }
  // From 2 m above the lower one, 2 x 2 m of which are hidden: those seen are 2.44 x 1.83 m.
  const Views views{{}, {lookAt({0, 0, 2}, {0, 0, 0}, Vector3d::UnitY())}, {}};
  const TriangleMesh seen = seenSurface(mesh, views, {0.05f});
  EXPECT_NEAR(areaOf(seen), 1.0 + (2.438 * 1.829 - 2.0 * 1.829), 0.25);
}

/// A strip that a single column of pixels falls on may be of anything; of a wider one they tell how
/// it runs.
TEST(SeenSurface, IsWhatPixelsTellThePlaneOf) {
  const Views views{{}, {lookAt({0, 0, 2}, {0, 0, 0}, Vector3d::UnitY())}, {}};
  const auto seenOf = [&](double wide_m) {  // a pixel is 1.9 mm wide there
    TriangleMesh mesh = makeRectangle(-2, -2, 2, 2, 0);
    addQuad(mesh, {0.0f, -0.3f, 1}, {static_cast<float>(wide_m), -0.3f, 1},
            {static_cast<float>(wide_m), 0.3f, 1}, {0.0f, 0.3f, 1});
    const TriangleMesh seen = seenSurface(mesh, views, {0.05f});
    return std::count_if(seen.vertices.begin(), seen.vertices.end(),
                         [](const Eigen::Vector3f& p) { return p.z() > 0.5f; });
  };
  EXPECT_EQ(seenOf(0.0019), 0);
  EXPECT_GT(seenOf(0.0057), 10);
}

TEST(SceneTruth, KnowsWhatIsSolidAndWhatIsSeenThrough) {
  Scene scene;
  scene.add(makeBox({0, 0, 0}, {2, 0.002, 2}));
  const Views views{{}, {lookAt({0, -2, 0}, {0, 0, 0}, Vector3d::UnitZ())}, {}};
  const SceneTruth truth(scene, views);
  const auto box = [](double y0, double y1) {
    return AlignedBox3d(Vector3d(0.1, y0, 0.1), Vector3d(0.2, y1, 0.2));
  };
  EXPECT_TRUE(truth.isTaken(box(-0.09, 0.05)));
  EXPECT_FALSE(truth.isTaken(box(-0.09, -0.0015)));
  EXPECT_TRUE(isSeenThrough(truth, views, box(-0.09, -0.0015), 5.0));
  EXPECT_FALSE(isSeenThrough(truth, views, box(-0.09, -0.0015), 1.9));
  EXPECT_FALSE(isSeenThrough(truth, views, box(0.0015, 0.09), 5.0));
  const auto from_front = truth.distanceFrom({0.1, -0.5, 0.1});
  ASSERT_TRUE(from_front);
  EXPECT_NEAR(from_front->to_seen_m, 0.499, 1e-6);
  EXPECT_FALSE(truth.distanceFrom({0.1, 0.5, 0.1}));  // of the back no view tells
}

TEST(SpaceFigures, HoldForShapesSeenFromAllRound) {
  const ViewedScene viewed = thinned(viewedSceneFromName("shapes"), 4);
  const MapperParams params = mapParams(0.05, 2, 1.0);
  const auto mapper = mapOf(viewed, params);
  const Space& space = *mapper->space();
  const SceneTruth truth(viewed.scene, viewed.views);
  const SpaceFigures figures = measureSpace(space, truth, {viewed.views, 1.0, 5.0, 500});
  EXPECT_GT(figures.at_middles.count, 300u);
  EXPECT_LT(figures.at_middles.rmse_m, 0.5 * figures.cell_m);
  EXPECT_LT(figures.at_points.rmse_m, 0.5 * figures.cell_m);
  EXPECT_EQ(figures.at_middles.far_below + figures.at_middles.far_above, 0u);
  EXPECT_EQ(figures.taken, 0u);
  EXPECT_EQ(figures.unseen, 0u);
  EXPECT_GT(figures.truly_free, 100u);
  EXPECT_GT(figures.found_free, 0.6 * figures.truly_free);

  // They tell what is wrong: of another scene distances are off, and free cells are not free.
  Scene other = viewed.scene;
  other.add(makeBox({0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}));
  const SpaceFigures wrong =
      measureSpace(space, SceneTruth(other, viewed.views), {viewed.views, 1.0, 5.0, 500});
  EXPECT_GT(wrong.taken, 10u);
  EXPECT_GE(wrong.unseen, wrong.taken);
  EXPECT_GT(wrong.at_middles.far_above, 0u);
}

/// The proof of docs/results/space.md in small: a plate of 2 mm in cells of 50 mm.
TEST(PathPastPlate, LeadsThroughTheDoorwayOnly) {
  for (const bool gap : {false, true}) {
    const auto mapper = mapOf(thinned(corridorWithPlate(0.002, gap), 3), mapParams(0.05, 1, 0.5));
    for (const bool through_unknown : {false, true}) {
      const auto way = findPath(*mapper->space(), corridorStart(), corridorGoal(),
                                {0.15, through_unknown, corridorBounds()});
      ASSERT_EQ(way.has_value(), gap) << through_unknown;
      const Passage passage{0.15, through_unknown, corridorBounds()};
      const auto over_grid = findPath(*mapper->space(), corridorStart(), corridorGoal(),
                                      GroundPassage(*mapper->space(), {-0.3, 0.3}, passage));
      ASSERT_EQ(over_grid.has_value(), gap) << through_unknown;
      if (!way) continue;
      EXPECT_GE(way->length_m, (corridorGoal() - corridorStart()).norm() - 0.05);
      EXPECT_LT(way->length_m, 4.0);
      for (const Vector3d& p : way->points_W) {
        EXPECT_FALSE(std::abs(p.x() - 0.013) < 0.1 && p.y() > -0.33) << p.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace dtsdf
