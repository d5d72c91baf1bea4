// A small isolated piece of the mesh disappears when a larger one appears next to it, even in
// unchanged blocks; also in a part of a map.
#include <gtest/gtest.h>

#include "kernels/core/grid.h"
#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"
#include "support/same_bytes.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kFront_m = 0.031;
const Box kSmall = makeBox({0.09, 0.08, kFront_m - 0.01}, {0.04, 0.04, 0.02});
/// The side towards the small box is in the next block, four voxels from that box.
const Box kLarge = makeBox({0.405, 0.08, kFront_m - 0.01}, {0.43, 0.4, 0.02});
constexpr BlockKey kSmallBoxBlock{0, 0, 0};

/// Frames of a camera that looks along -z at the box alone.
std::vector<SceneFrame> framesOf(const Box& box) {
  Scene scene;
  scene.add(box);
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear() = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  T_W_C.translation() = Vector3d(0.25, 0.08, 0.7);
  return renderFrames(scene, std::vector<Eigen::Isometry3d>(4, T_W_C), 320, 240);
}

void fuse(ProbedMapper& mapper, const std::vector<SceneFrame>& frames) {
  for (const SceneFrame& frame : frames) mapper.integrate(frame.view());
}

size_t trianglesOf(const MeshStore& mesh, const BlockKey& key) {
  const auto found = mesh.blocks().find(packKey(key));
  return found == mesh.blocks().end() ? 0 : found->second->triangles.size();
}

class LoosePiece : public testing::Test {
 protected:
  const MapperParams params_ = makeCpuParams();
  const std::vector<SceneFrame> small_ = framesOf(kSmall), large_ = framesOf(kLarge);
};

TEST_F(LoosePiece, VanishesWhenALargerOneAppearsNearby) {
  const auto grown = makeProbedMapper(params_), at_once = makeProbedMapper(params_);
  MeshStore mesh(params_.map.voxel_size_m), expected(params_.map.voxel_size_m);
  fuse(*grown, small_);
  mesh.apply(grown->updateMesh());
  EXPECT_GT(trianglesOf(mesh, kSmallBoxBlock), 0u) << "a single piece stays";
  fuse(*grown, large_);
  mesh.apply(grown->updateMesh());
  EXPECT_EQ(trianglesOf(mesh, kSmallBoxBlock), 0u);
  fuse(*at_once, small_);
  fuse(*at_once, large_);
  expected.apply(at_once->updateMesh());
  ASSERT_EQ(mesh.blocks().size(), expected.blocks().size());
  for (const auto& [key, block] : expected.blocks()) {
    ASSERT_EQ(mesh.blocks().count(key), 1u);
    EXPECT_TRUE(sameBytes(mesh.blocks().at(key)->vertices, block->vertices));
    EXPECT_TRUE(sameBytes(mesh.blocks().at(key)->triangles, block->triangles));
  }
}

TEST_F(LoosePiece, AlsoVanishesInAPartOfTheMap) {
  MapperParams kept = params_;
  kept.mesh.loose_voxels = 0;
  for (const MapperParams& params : {params_, kept}) {
    const auto part = makeProbedMapper(params);
    const BlockExtent wide{{-1, -1, -1}, {1, 1, 1}};  // a tile with a margin of one block
    part->restrictTo({wide, wide, BlockExtent()});
    fuse(*part, small_);
    fuse(*part, large_);
    MeshStore mesh(params.map.voxel_size_m);
    mesh.apply(part->updateMesh());
    EXPECT_EQ(trianglesOf(mesh, kSmallBoxBlock) == 0, params.mesh.loose_voxels > 0);
  }
}

}  // namespace
}  // namespace dtsdf
