// The same frames give the same map and mesh, to the last bit, however the work is cut up.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"
#include "support/map_equality.h"

namespace dtsdf {
namespace {

using Mode = std::tuple<FusionMode, bool>;

/// A mapper and the mesh put together from all its updates.
class Session {
 public:
  explicit Session(const MapperParams& params)
      : mapper_(makeProbedMapper(params)), store_(params.map.voxel_size_m) {}

  void integrate(const SceneFrame& frame) {
    EXPECT_EQ(mapper_->integrate(frame.view()).status, FrameStatus::kFused);
  }
  void updateMesh() { store_.apply(mapper_->updateMesh()); }
  void clear() {
    mapper_->clear();
    store_.clear();
  }
  ProbedMapper& mapper() { return *mapper_; }
  Mesh mesh() const { return store_.assemble(); }

 private:
  std::unique_ptr<ProbedMapper> mapper_;
  MeshStore store_;
};

/// Frames of the room from a time on; rendered once.
const std::vector<SceneFrame>& roomFrames(double first_s, int count) {
  static std::map<std::pair<double, int>, std::vector<SceneFrame>> rendered;
  std::vector<SceneFrame>& frames = rendered[{first_s, count}];
  if (!frames.empty()) return frames;
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) poses.push_back(roomCameraPose(first_s + 0.5 * i));
  frames = renderFrames(makeRoomScene(), poses, 120, 90);
  return frames;
}

class Determinism : public testing::TestWithParam<Mode> {
 protected:
  MapperParams params(int threads) const {
    return makeCpuParams(std::get<0>(GetParam()), std::get<1>(GetParam()), 0.04f, threads);
  }
};

TEST_P(Determinism, MeshingEveryFrameEqualsMeshingOnce) {
  Session often(params(2)), once(params(2));
  for (const SceneFrame& frame : roomFrames(0.0, 6)) {
    often.integrate(frame);
    often.updateMesh();
    once.integrate(frame);
  }
  once.updateMesh();
  EXPECT_GT(once.mesh().triangles.size(), 1000u);
  EXPECT_TRUE(sameMeshes(often.mesh(), once.mesh()));
  EXPECT_TRUE(often.mapper().updateMesh().blocks.empty()) << "nothing has changed since";
}

TEST_P(Determinism, ThreadsDoNotShow) {
  Session one(params(1));
  for (const SceneFrame& frame : roomFrames(3.0, 4)) one.integrate(frame);
  one.updateMesh();
  for (const int threads : {2, 3}) {
    Session several(params(threads));
    for (const SceneFrame& frame : roomFrames(3.0, 4)) several.integrate(frame);
    several.updateMesh();
    EXPECT_TRUE(sameMaps(one.mapper(), several.mapper())) << threads << " threads";
    EXPECT_TRUE(sameMeshes(one.mesh(), several.mesh())) << threads << " threads";
  }
}

TEST_P(Determinism, RunsAreEqual) {
  Session first(params(2)), second(params(2));
  for (Session* session : {&first, &second}) {
    for (const SceneFrame& frame : roomFrames(6.0, 4)) session->integrate(frame);
    session->updateMesh();
  }
  EXPECT_TRUE(sameMaps(first.mapper(), second.mapper()));
  EXPECT_TRUE(sameMeshes(first.mesh(), second.mesh()));
}

TEST_P(Determinism, AClearedMapIsLikeNew) {
  Session used(params(2)), fresh(params(2));
  for (const SceneFrame& frame : roomFrames(12.0, 3)) used.integrate(frame);
  used.updateMesh();
  used.clear();
  const MapStats stats = used.mapper().stats();
  EXPECT_EQ(stats.blocks + stats.voxel_arrays + stats.map_bytes + stats.refused_blocks, 0u);
  EXPECT_TRUE(used.mapper().snapshot().empty());
  EXPECT_TRUE(used.mapper().updateMesh().blocks.empty());
  for (Session* session : {&used, &fresh}) {
    for (const SceneFrame& frame : roomFrames(0.0, 3)) session->integrate(frame);
    session->updateMesh();
  }
  EXPECT_TRUE(sameMaps(used.mapper(), fresh.mapper()));
  EXPECT_TRUE(sameMeshes(used.mesh(), fresh.mesh()));
}

INSTANTIATE_TEST_SUITE_P(All, Determinism,
                         testing::Combine(testing::Values(FusionMode::kVoxelProjection,
                                                          FusionMode::kRayCasting,
                                                          FusionMode::kNormalRayCasting),
                                          testing::Bool()),
                         [](const testing::TestParamInfo<Mode>& info) {
                           return modeName(std::get<0>(info.param), std::get<1>(info.param));
                         });

TEST(CpuMapper, SaysItsNameAndIsMadeWhenAskedFor) {
  EXPECT_EQ(makeProbedMapper(makeCpuParams())->backendName(), "cpu (2 threads)");
  MapperParams params = makeCpuParams();
  params.threads = 1;
  EXPECT_EQ(makeProbedMapper(params)->backendName(), "cpu (1 thread)");
}

TEST(CpuMapper, AnExtractionIsHandedOutOnce) {
  Session session(makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f));
  EXPECT_TRUE(session.mapper().finishMeshUpdate().blocks.empty()) << "none was begun";
  session.integrate(roomFrames(0.0, 1)[0]);
  session.mapper().beginMeshUpdate();
  EXPECT_FALSE(session.mapper().finishMeshUpdate().blocks.empty());
  EXPECT_TRUE(session.mapper().finishMeshUpdate().blocks.empty());
}

}  // namespace
}  // namespace dtsdf
