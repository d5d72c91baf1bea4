// The numbers of the mesh's rules reach the stages that use them.
#include <gtest/gtest.h>

#include "kernels/core/vec.h"
#include "kernels/meshing/corner_grid.h"
#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// A box on its corner: its creases lie across the grid, so that several directions vote in a unit.
MeshUpdate meshOfBox(const MeshRules& mesh_rules, bool directional = true) {
  Scene scene;
  scene.add(makeBox(Vector3d(0.013, 0.007, 0.004), Vector3d(0.3, 0.2, 0.1), 0.5));
  Rules rules;
  rules.mesh = mesh_rules;
  const auto mapper =
      makeProbedMapper(makeCpuParams(FusionMode::kNormalRayCasting, directional), rules);
  for (const SceneFrame& frame :
       renderFrames(scene, sphereOfPoses(Vector3d::Zero(), 0.8, 6), 96, 72)) {
    mapper->integrate(frame.view());
  }
  return mapper->updateMesh();
}

size_t countTriangles(const MeshUpdate& update) {
  size_t corners = 0;
  for (const BlockMesh& block : update.blocks) corners += block.triangles.size();
  return corners / 3;
}

TEST(MeshRulesInAMapper, AGreaterShareOfWeightLeavesUnitsOut) {
  MeshRules rules;
  rules.least_weight_share = 0.0f;
  size_t fewest = countTriangles(meshOfBox(rules));
  for (const float share : {0.05f, 0.5f}) {
    rules.least_weight_share = share;
    const size_t triangles = countTriangles(meshOfBox(rules));
    EXPECT_LT(triangles, fewest) << share;
    fewest = triangles;
  }
}

TEST(MeshRulesInAMapper, NearnessTellsInTheVote) {
  MeshRules flat;
  flat.nearness_voxels = 16.0f;
  EXPECT_NE(countTriangles(meshOfBox(flat)), countTriangles(meshOfBox(MeshRules())));
}

}  // namespace
}  // namespace dtsdf
