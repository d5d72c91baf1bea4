// The same frames give the same map and mesh, to the last bit, however the work is cut up.
#include <gtest/gtest.h>

#include <tuple>
#include <vector>

#include "support/depth_frames.h"
#include "support/map_equality.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Mode = std::tuple<FusionMode, bool>;

/// Frames of the room from a time on.
std::vector<SceneFrame> roomFrames(double first_s, int count) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) poses.push_back(roomCameraPose(first_s + 0.5 * i));
  return renderFrames(makeRoomScene(), poses, 120, 90);
}

class Determinism : public testing::TestWithParam<Mode> {
 protected:
  MapperParams params(int threads) const {
    return makeCpuParams(std::get<0>(GetParam()), std::get<1>(GetParam()), 0.04f, threads);
  }
};

/// Where meshes grow and shrink, blocks go, and others take their places.
TEST_P(Determinism, MeshingEveryFrameEqualsMeshingOnce) {
  for (const int min_support : {1, 2}) {
    MapperParams settings = params(2);
    settings.mesh.min_support = min_support;
    Session often(settings), late(settings), once(settings);
    for (const SceneFrame& frame : movingFrames(32)) {
      for (Session* session : {&often, &late, &once}) session->integrate(frame);
      often.updateMesh();
      late.finishMeshUpdate();  // of what the frame before left
      late.mapper().beginMeshUpdate();
    }
    once.updateMesh();
    late.finishMeshUpdate();
    late.updateMesh();
    EXPECT_GT(once.mesh().triangles.size(), 500u);
    for (Session* session : {&often, &late}) {
      EXPECT_TRUE(sameMaps(session->mapper(), once.mapper()));
      EXPECT_TRUE(sameMeshes(session->mesh(), once.mesh()));
      EXPECT_EQ(session->mapper().stats().map_bytes, once.mapper().stats().map_bytes);
      EXPECT_TRUE(session->mapper().updateMesh().blocks.empty()) << "nothing has changed since";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Determinism,
                         testing::Combine(testing::Values(FusionMode::kVoxelProjection,
                                                          FusionMode::kRayCasting,
                                                          FusionMode::kNormalRayCasting),
                                          testing::Bool()),
                         [](const testing::TestParamInfo<Mode>& info) {
                           return modeName(std::get<0>(info.param), std::get<1>(info.param));
                         });

TEST(Mapper, SaysItsNameAndIsMadeWhenAskedFor) {
  EXPECT_EQ(makeProbedMapper(makeCpuParams())->backendName(), "cpu (2 threads)");
  MapperParams params = makeCpuParams();
  params.threads = 1;
  EXPECT_EQ(makeProbedMapper(params)->backendName(), "cpu (1 thread)");
}

TEST(Mapper, AnExtractionIsHandedOutOnce) {
  Session session(makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f));
  EXPECT_TRUE(session.mapper().finishMeshUpdate().blocks.empty()) << "none was begun";
  session.integrate(roomFrames(0.0, 1)[0]);
  session.mapper().beginMeshUpdate();
  EXPECT_FALSE(session.mapper().finishMeshUpdate().blocks.empty());
  EXPECT_TRUE(session.mapper().finishMeshUpdate().blocks.empty());
}

}  // namespace
}  // namespace dtsdf
