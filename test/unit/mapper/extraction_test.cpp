#include <gtest/gtest.h>

#include "support/depth_frames.h"
#include "support/session.h"

namespace dtsdf {
namespace {

TEST(Mapper, ReportsItsBackend) {
  EXPECT_EQ(makeProbedMapper(makeCpuParams())->backendName(), "cpu (2 threads)");
  MapperParams params = makeCpuParams();
  params.threads = 1;
  EXPECT_EQ(makeProbedMapper(params)->backendName(), "cpu (1 thread)");
}

TEST(Mapper, ReturnsAnExtractionOnce) {
  Session session(makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f));
  EXPECT_TRUE(session.mapper().finishMeshUpdate().blocks.empty());
  session.integrate(renderFrames(makeRoomScene(), {roomCameraPose(0.0)}, 120, 90)[0]);
  session.mapper().beginMeshUpdate();
  EXPECT_FALSE(session.mapper().finishMeshUpdate().blocks.empty());
  EXPECT_TRUE(session.mapper().finishMeshUpdate().blocks.empty());
}

}  // namespace
}  // namespace dtsdf
