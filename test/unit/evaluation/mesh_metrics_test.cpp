#include "evaluation/mesh_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "evaluation/boundary_edges.h"
#include "evaluation/depth_renderer.h"
#include "simulation/scene.h"
#include "support/temporary_folder.h"
#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

const EvaluationOptions kQuick{100000, {0.005, 0.01, 0.025}};

TEST(MeshScene, ClosestPointMatchesTheAnalyticDistance) {
  const MeshScene scene(makeCube(0.5f));
  Scene truth;
  truth.add(makeBox(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()));
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3f p = 1.5f * Eigen::Vector3f::Random();
    ASSERT_NEAR(scene.closestPoint(p).distance_m, truth.distanceToSurface(p.cast<double>()), 1e-7);
  }
}

TEST(DistanceStats, MatchKnownValues) {
  const DistanceStats stats = distanceStats({3.0, 0.0, 4.0, 1.0});
  EXPECT_EQ(stats.count, 4u);
  EXPECT_DOUBLE_EQ(stats.rmse_m, std::sqrt(26.0 / 4.0));
  EXPECT_DOUBLE_EQ(stats.mean_m, 2.0);
  EXPECT_DOUBLE_EQ(stats.median_m, 3.0);
  EXPECT_DOUBLE_EQ(stats.max_m, 4.0);
  std::vector<double> ramp;
  for (int i = 0; i < 100; ++i) ramp.push_back(i);
  EXPECT_DOUBLE_EQ(distanceStats(ramp).p95_m, 95.0);
  EXPECT_EQ(distanceStats({}).count, 0u);
}

TEST(Evaluation, MeasuresAShiftedPlane) {
  const Evaluation evaluation = evaluateMesh(makeRectangle(-0.5f, -0.5f, 0.5f, 0.5f, 0.007f),
                                             makeRectangle(-1, -1, 1, 1, 0), nullptr, kQuick);
  EXPECT_NEAR(evaluation.vertices.rmse_m, 0.007, 1e-8);
  EXPECT_NEAR(evaluation.surface.rmse_m, 0.007, 1e-8);
  EXPECT_NEAR(evaluation.surface.median_m, 0.007, 1e-8);
  EXPECT_NEAR(evaluation.surface.max_m, 0.007, 1e-8);
}

/// Points in the missing half are 0 to 1 m away from the rest, so the mean square is 1/2 * 1/3.
TEST(Evaluation, MeasuresAHalfMissingPlane) {
  const Evaluation evaluation =
      evaluateMesh(makeRectangle(0, 0, 1, 1, 0), makeRectangle(0, 0, 2, 1, 0), nullptr, kQuick);
  EXPECT_NEAR(evaluation.surface.rmse_m, 0.0, 1e-7);
  EXPECT_NEAR(evaluation.completeness.rmse_m, std::sqrt(1.0 / 6.0), 3e-3);
  EXPECT_NEAR(evaluation.completeness.mean_m, 0.25, 3e-3);
  EXPECT_NEAR(evaluation.completeness.max_m, 1.0, 1e-3);
  const FScore& score = evaluation.f_scores[0];
  EXPECT_DOUBLE_EQ(score.precision, 1.0);
  EXPECT_NEAR(score.recall, 0.5 + 0.005 / 2.0, 2e-3);
  EXPECT_NEAR(score.f_score, 2.0 * score.recall / (1.0 + score.recall), 1e-12);
}

TEST(Evaluation, JsonIsInMillimetres) {
  const auto json =
      nlohmann::json::parse(toJson(evaluateMesh(makeRectangle(-0.5f, -0.5f, 0.5f, 0.5f, 0.007f),
                                                makeRectangle(-1, -1, 1, 1, 0), nullptr, kQuick)));
  EXPECT_NEAR(json["surface"]["rmse_mm"].get<double>(), 7.0, 1e-5);
  EXPECT_EQ(json["topology"]["boundary_edges"].get<int>(), 4);
}

/// The camera at z = 3 faces down, so only the top of the cube, a sixth of its area, is visible.
TEST(SeenByViews, IncludesOnlyFacingSurfaces) {
  const MeshScene cube(makeCube(0.5f));
  const SurfaceSamples samples = sampleSurface(cube.mesh(), 60000, 1);
  Views views;
  views.poses_W_C = {lookAt({0, 0, 3}, {0, 0, 0}, Eigen::Vector3d::UnitY())};
  const std::vector<bool> seen = seenByViews(cube, samples, views);
  for (size_t i = 0; i < seen.size(); ++i) {
    const bool on_top = samples.triangles[i] / 2 == 1;
    if (!on_top && samples.points[i].z() > 0.499f) continue;  // the edge belongs to both faces
    ASSERT_EQ(seen[i], on_top) << samples.points[i].transpose();
  }
}

TEST(SeenByViews, ExcludesHiddenAndOutOfViewPoints) {
  // A sheet from x = -1 to 1, and a second sheet above it that occludes its right half.
  const MeshScene sheets(
      joined(makeRectangle(-1, -1, 1, 1, 0), makeRectangle(0, -2, 2, 2, 0.001f)));
  const SurfaceSamples samples = sampleSurface(sheets.mesh(), 20000, 1);
  Views views;
  views.poses_W_C = {lookAt({0, 0, 2}, {0, 0, 0}, Eigen::Vector3d::UnitY())};
  views.camera.width = 525;  // half a metre to each side at a distance of 2 m
  views.camera.height = 525;
  views.camera.intrinsics = {1050, 1050, 262, 262};
  const std::vector<bool> seen = seenByViews(sheets, samples, views);
  size_t count = 0;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    ++count;
    const Eigen::Vector3f& p = samples.points[i];
    EXPECT_LT(p.head<2>().cwiseAbs().maxCoeff(), 0.501f);
    EXPECT_TRUE(p.z() > 0.0f || p.x() < 0.002f);
  }
  EXPECT_NEAR(static_cast<double>(count), 20000.0 * 1.0 / 12.0, 100.0);
}

/// A surface counts as visible only where the recorded depth image measured it.
TEST(SeenByViews, ExcludesUnmeasuredPoints) {
  const TemporaryFolder folder;
  const MeshScene sheet(makeRectangle(-0.5f, -0.5f, 0.5f, 0.5f, 0));
  const std::vector<Eigen::Isometry3d> poses_W_C = {
      lookAt({0, 0, 2}, {0, 0, 0}, Eigen::Vector3d::UnitY())};
  std::vector<float> depth_m;  // nothing measured on the left, something nearer on the right
  for (int i = 0; i < 640 * 480; ++i) {
    const int u = i % 640;
    depth_m.push_back(u < 280 ? 0.0f : u < 360 ? 2.03f : 1.5f);
  }
  const TumWriter writer(folder.path(), ViewCamera{}, poses_W_C);
  writer.write(0, toTumDepth(depth_m));
  writer.finish("test");
  const SurfaceSamples samples = sampleSurface(sheet.mesh(), 2000, 1);
  const std::vector<bool> seen = seenByViews(sheet, samples, readViews(folder.path()));
  for (size_t i = 0; i < seen.size(); ++i) {
    const float u = 525.0f * samples.points[i].x() / 2.0f + 319.5f;
    if (std::abs(u - 279.5f) < 0.1f || std::abs(u - 359.5f) < 0.1f) continue;
    ASSERT_EQ(seen[i], u > 279.5f && u < 359.5f) << u;
  }
}

TEST(MeshTopology, CountsBoundaryEdges) {
  TriangleMesh cube = makeCube(0.5f);
  EXPECT_EQ(meshTopology(cube).boundary_edges, 0u);
  cube.triangles.pop_back();
  EXPECT_EQ(meshTopology(cube).boundary_edges, 3u);
  EXPECT_EQ(meshTopology(makeSphere(0.5f, 12)).boundary_edges, 0u);
}

/// A sheet of 0.1 m squares that do not share vertices, without the squares at the (column, row)
/// positions in `missing`.
TriangleMesh makePiercedSheet(int side, const std::set<std::pair<int, int>>& missing) {
  TriangleMesh sheet;
  const auto at = [](int i) { return 0.1f * static_cast<float>(i); };
  for (int i = 0; i < side * side; ++i) {
    const int x = i % side, y = i / side;
    if (missing.count({x, y}) > 0) continue;
    addQuad(sheet, {at(x), at(y), 0}, {at(x + 1), at(y), 0}, {at(x + 1), at(y + 1), 0},
            {at(x), at(y + 1), 0});
  }
  return sheet;
}

TEST(MeshTopology, BordersAndHolesUseWeldedVertices) {
  const auto of = [](const std::set<std::pair<int, int>>& missing) {
    const MeshTopology topology = meshTopology(makePiercedSheet(20, missing));
    return std::pair(topology.border_edges, topology.small_holes);
  };
  using Counts = std::pair<size_t, size_t>;
  EXPECT_EQ(of({}), Counts(80, 0)) << "the outer border should have 80 edges";
  EXPECT_EQ(of({{5, 5}, {9, 9}, {10, 9}}), Counts(80 + 4 + 6, 2));
  EXPECT_EQ(of({{5, 5}, {6, 6}}), Counts(80 + 8, 2));
  EXPECT_EQ(of({{5, 0}}), Counts(82, 0)) << "a notch should be part of the border";
  std::set<std::pair<int, int>> line;
  for (int i = 0; i < 7; ++i) line.insert({5 + i, 5});
  EXPECT_EQ(of(line), Counts(80 + 16, 1)) << "a hole with 16 edges should still count as small";
  line.insert({12, 5});
  EXPECT_EQ(of(line), Counts(80 + 18, 0));
  EXPECT_EQ(meshTopology(makeCube(0.5f)).border_edges, 0u);
  EXPECT_EQ(meshTopology(makePiercedSheet(20, {})).boundary_edges, 1600u);
}

TEST(MeshTopology, ComponentsAreConnectedByVertices) {
  TriangleMesh mesh = joined(makeCube(0.5f), makeCube(0.5f));
  EXPECT_EQ(meshTopology(mesh).components, 2u) << "coincident vertices should not be welded";
  mesh.triangles.push_back({0, 1, 12});
  EXPECT_EQ(meshTopology(mesh).components, 1u);
}

}  // namespace
}  // namespace dtsdf
