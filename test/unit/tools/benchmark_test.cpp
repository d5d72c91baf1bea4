#include <gtest/gtest.h>

#include "benchmark/flight.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {
namespace {

TEST(Flight, DepthMatchesTheGround) {
  const SourceFrame frame = renderFlightFrame(3.0);
  const DepthFrame& depth = frame.depth;
  for (const int u : {0, 100, 320, 639}) {
    for (const int v : {0, 240, 479}) {
      const double z = static_cast<const uint16_t*>(depth.data)[v * depth.width + u] *
                       static_cast<double>(depth.unit_m);
      const Eigen::Vector3d p_C((u - depth.intrinsics.cx) / depth.intrinsics.fx * z,
                                (v - depth.intrinsics.cy) / depth.intrinsics.fy * z, z);
      const Eigen::Vector3d p_W = depth.T_W_C * p_C;
      EXPECT_NEAR(p_W.z(), groundHeight(p_W.x(), p_W.y()), 1e-3);
    }
  }
}

TEST(Flight, ReturnsOverTheSameGround) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.map.voxel_size_m = 0.08f;
  const auto mapper = makeProbedMapper(params, Rules());
  const std::vector<FrameTime> times = fly(*mapper, size_t(2) << 20, 2.0, true, [](size_t) {});
  ASSERT_GE(times.size(), 4u);
  ASSERT_EQ(times.size() % 2, 0u);
  for (size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ(times[i].on_return, i >= times.size() / 2);
    EXPECT_EQ(times[i].mapped_bytes, times[times.size() - 1 - i].mapped_bytes);
  }
  EXPECT_LT(mapper->stats().map_bytes, size_t(3) << 20) << "the way back should not add blocks";
}

}  // namespace
}  // namespace dtsdf
