// Tests that frames that cannot be fused leave the map unchanged and report what is wrong, and that
// unusual but valid frames are fused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"
#include "support/map_equality.h"

namespace dtsdf {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

MapperParams testParams() { return makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f); }

/// A frame of the room, or one from a later pose if `later` is set. Both are rendered only once.
SceneFrame goodFrame(bool later = false) {
  static const SceneFrame frames[] = {renderFrame(makeRoomScene(), roomCameraPose(0.0), 80, 60),
                                      renderFrame(makeRoomScene(), roomCameraPose(2.0), 80, 60)};
  return frames[later ? 1 : 0];
}

struct BadFrame {
  std::string name;
  FrameStatus status;
  std::function<void(DepthFrame&)> spoil;
};

/// Without this operator, GoogleTest would print the bytes of a BadFrame.
std::ostream& operator<<(std::ostream& out, const BadFrame& frame) { return out << frame.name; }

BadFrame badPose(const std::string& name, const std::function<void(DepthFrame&)>& spoil) {
  return {name, FrameStatus::kBadPose, spoil};
}

std::vector<BadFrame> badImages() {
  const FrameStatus status = FrameStatus::kBadImage;
  return {
      {"NoData", status, [](DepthFrame& f) { f.data = nullptr; }},
      {"NoWidth", status, [](DepthFrame& f) { f.width = 0; }},
      {"NoHeight", status, [](DepthFrame& f) { f.height = 0; }},
      {"NegativeWidth", status, [](DepthFrame& f) { f.width = -80; }},
      {"NegativeSizes", status, [](DepthFrame& f) { f.width = f.height = -60; }},
      {"TooLarge", status,
       [](DepthFrame& f) {
         f.width = 4096;
         f.height = 2049;
         f.row_bytes = 4 * 4096;
       }},
      {"ProductOverflows", status,
       [](DepthFrame& f) {
         f.width = f.height = 1 << 16;
         f.row_bytes = size_t(4) << 16;
       }},
      {"ShortRows", status, [](DepthFrame& f) { --f.row_bytes; }},
      {"NoRowBytes", status, [](DepthFrame& f) { f.row_bytes = 0; }},
      {"ZeroUnit", status, [](DepthFrame& f) { f.unit_m = 0.0f; }},
      {"NanUnit", status, [](DepthFrame& f) { f.unit_m = kNan; }},
      {"InfiniteUnit", status, [](DepthFrame& f) { f.unit_m = kInfinity; }},
      {"MillimetresAsMetres", FrameStatus::kNoMeasurement,
       [](DepthFrame& f) { f.unit_m = 1000.0f; }},
  };
}

std::vector<BadFrame> badIntrinsics() {
  const FrameStatus status = FrameStatus::kBadIntrinsics;
  return {
      {"ZeroFx", status, [](DepthFrame& f) { f.intrinsics.fx = 0.0f; }},
      {"ZeroFy", status, [](DepthFrame& f) { f.intrinsics.fy = 0.0f; }},
      {"NegativeFx", status, [](DepthFrame& f) { f.intrinsics.fx = -100.0f; }},
      {"NanFx", status, [](DepthFrame& f) { f.intrinsics.fx = kNan; }},
      {"NanCx", status, [](DepthFrame& f) { f.intrinsics.cx = kNan; }},
      {"InfiniteCy", status, [](DepthFrame& f) { f.intrinsics.cy = kInfinity; }},
      {"InfiniteFy", status, [](DepthFrame& f) { f.intrinsics.fy = kInfinity; }},
      {"TinyFx", status, [](DepthFrame& f) { f.intrinsics.fx = 1e-30f; }},
      {"NormalisedIntrinsics", status,
       [](DepthFrame& f) {
         f.intrinsics = {0.8f, 1.1f, 0.5f, 0.5f};
       }},
      {"NormalisedPrincipalPoint", status,
       [](DepthFrame& f) { f.intrinsics.cx = f.intrinsics.cy = 0.5f; }},
  };
}

std::vector<BadFrame> badPoses() {
  return {
      badPose("NanTranslation", [](DepthFrame& f) { f.T_W_C.translation().x() = kNan; }),
      badPose("InfiniteTranslation", [](DepthFrame& f) { f.T_W_C.translation().z() = kInfinity; }),
      badPose("NanRotation", [](DepthFrame& f) { f.T_W_C.linear()(1, 2) = kNan; }),
      badPose("ZeroRotation", [](DepthFrame& f) { f.T_W_C.linear().setZero(); }),
      badPose("Scaled", [](DepthFrame& f) { f.T_W_C.linear() *= 1.1; }),
      badPose("Mirrored", [](DepthFrame& f) { f.T_W_C.linear().col(0) *= -1.0; }),
      badPose("Sheared", [](DepthFrame& f) { f.T_W_C.linear()(0, 1) += 0.2; }),
      badPose("BeyondTheMap", [](DepthFrame& f) { f.T_W_C.translation().y() = 1e9; }),
      // The pose is valid, but the view lies outside the map.
      badPose("HugeCx", [](DepthFrame& f) { f.intrinsics.cx = 1e30f; }),
      badPose("HugeCy", [](DepthFrame& f) { f.intrinsics.cy = -1e12f; }),
      badPose("FarBeyondTheMap", [](DepthFrame& f) { f.T_W_C.translation().y() = -1e300; }),
  };
}

class BadFrames : public testing::TestWithParam<BadFrame> {};

TEST_P(BadFrames, LeaveTheMapUntouched) {
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(testParams());
  const std::unique_ptr<ProbedMapper> reference = makeProbedMapper(testParams());
  const SceneFrame first = goodFrame(), second = goodFrame(true);
  mapper->integrate(first.view());
  reference->integrate(first.view());
  mapper->updateMesh();
  DepthFrame bad = second.view();
  GetParam().spoil(bad);
  const IntegrationResult result = mapper->integrate(bad);
  EXPECT_EQ(result.status, GetParam().status) << toString(result.status) << ": " << result.message;
  EXPECT_FALSE(result.message.empty());
  EXPECT_EQ(result.refused_blocks, 0u);
  EXPECT_TRUE(sameMaps(*mapper, *reference));
  EXPECT_TRUE(mapper->updateMesh().blocks.empty());
  EXPECT_EQ(mapper->integrate(second.view()).status, FrameStatus::kFused);
}

std::string nameOf(const testing::TestParamInfo<BadFrame>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(Image, BadFrames, testing::ValuesIn(badImages()), nameOf);
INSTANTIATE_TEST_SUITE_P(Intrinsics, BadFrames, testing::ValuesIn(badIntrinsics()), nameOf);
INSTANTIATE_TEST_SUITE_P(Pose, BadFrames, testing::ValuesIn(badPoses()), nameOf);

TEST(EmptyDepth, IsNoMeasurement) {
  for (const float value : {0.0f, -1.0f, kNan, kInfinity, 0.05f}) {
    const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(testParams());
    SceneFrame frame = goodFrame();
    std::fill(frame.depth_m.begin(), frame.depth_m.end(), value);
    const IntegrationResult result = mapper->integrate(frame.view());
    EXPECT_EQ(result.status, FrameStatus::kNoMeasurement) << value;
    EXPECT_FALSE(result.message.empty());
    EXPECT_EQ(mapper->stats().blocks, 0u);
  }
}

/// Depths of 50 m are too far to be fused, but they still clear voxels. Without clearing, or with
/// voxel projection, the frame counts as empty.
TEST(EmptyDepth, OutOfRangeDepthOnlyClears) {
  SceneFrame frame = goodFrame();
  std::fill(frame.depth_m.begin(), frame.depth_m.end(), 50.0f);
  for (const bool clearing : {false, true}) {
    for (const FusionMode mode : {FusionMode::kVoxelProjection, FusionMode::kNormalRayCasting}) {
      MapperParams params = makeCpuParams(mode, true, 0.04f);
      params.fusion.clearing = clearing;
      const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(params);
      const bool clears = clearing && mode != FusionMode::kVoxelProjection;
      EXPECT_EQ(mapper->integrate(frame.view()).status,
                clears ? FrameStatus::kFused : FrameStatus::kNoMeasurement)
          << modeName(mode, true) << ", clearing " << clearing;
      EXPECT_EQ(mapper->stats().blocks, 0u);
    }
  }
}

/// NaN, infinity and other invalid values count as unmeasured, like 0.
TEST(OddFrames, InvalidPixelsAreHoles) {
  const auto odd = makeProbedMapper(testParams()), plain = makeProbedMapper(testParams());
  SceneFrame holes = goodFrame();
  for (size_t i = 0; i < holes.depth_m.size(); i += 7) holes.depth_m[i] = 0.0f;
  SceneFrame nonsense = holes;
  const float values[] = {kNan, kInfinity, -kInfinity, -2.0f, 1e30f, 1e-30f};
  for (size_t i = 0; i < nonsense.depth_m.size(); i += 7) nonsense.depth_m[i] = values[i / 7 % 6];
  EXPECT_EQ(odd->integrate(nonsense.view()).status, FrameStatus::kFused);
  EXPECT_EQ(plain->integrate(holes.view()).status, FrameStatus::kFused);
  EXPECT_TRUE(sameMaps(*odd, *plain));
}

TEST(OddFrames, RowPaddingIsSkipped) {
  const auto padded = makeProbedMapper(testParams()), plain = makeProbedMapper(testParams());
  const SceneFrame frame = goodFrame();
  constexpr size_t kPadding = 24;
  DepthFrame wide = frame.view();
  wide.row_bytes += kPadding;
  std::vector<float> pixels(wide.row_bytes / sizeof(float) * static_cast<size_t>(wide.height),
                            1.0f);
  for (int v = 0; v < wide.height; ++v) {
    std::memcpy(reinterpret_cast<char*>(pixels.data()) + static_cast<size_t>(v) * wide.row_bytes,
                &frame.depth_m[static_cast<size_t>(v * wide.width)], wide.row_bytes - kPadding);
  }
  wide.data = pixels.data();
  EXPECT_EQ(padded->integrate(wide).status, FrameStatus::kFused);
  EXPECT_EQ(plain->integrate(frame.view()).status, FrameStatus::kFused);
  EXPECT_TRUE(sameMaps(*padded, *plain));
}

/// A 16-bit image in units of 1 / 4096 m represents depths rounded to that unit exactly.
TEST(OddFrames, EncodingsAgree) {
  const auto whole = makeProbedMapper(testParams()), metres = makeProbedMapper(testParams());
  SceneFrame frame = goodFrame();
  constexpr float kUnit_m = 1.0f / 4096.0f;  // a power of two, for exact products
  std::vector<uint16_t> units;
  for (float& z : frame.depth_m) {
    units.push_back(static_cast<uint16_t>(std::lround(z / kUnit_m)));
    z = static_cast<float>(units.back()) * kUnit_m;
  }
  DepthFrame coded = frame.view();
  coded.data = units.data();
  coded.encoding = DepthEncoding::kUint16;
  coded.unit_m = kUnit_m;
  coded.row_bytes = static_cast<size_t>(coded.width) * sizeof(uint16_t);
  EXPECT_EQ(whole->integrate(coded).status, FrameStatus::kFused);
  EXPECT_EQ(metres->integrate(frame.view()).status, FrameStatus::kFused);
  EXPECT_TRUE(sameMaps(*whole, *metres));
}

TEST(OddFrames, RoundedRotationsAreAccepted) {
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(testParams());
  SceneFrame frame = goodFrame();
  frame.frame.T_W_C.linear() *= 1.0 + 1e-5;  // as after rounding
  EXPECT_EQ(mapper->integrate(frame.view()).status, FrameStatus::kFused);
}

/// A pixel without measured pixels around it has no normal. Only voxel projection into the
/// undirected map needs no normals, so only there do isolated pixels count.
TEST(LonelyPixels, CountIfNoNormalsAreNeeded) {
  SceneFrame frame = goodFrame();
  for (int v = 0; v < frame.frame.height; ++v) {
    for (int u = 0; u < frame.frame.width; ++u) {
      if (u % 3 != 0 || v % 3 != 0) frame.depth_m[v * frame.frame.width + u] = 0.0f;
    }
  }
  for (const bool directional : {false, true}) {
    for (const FusionMode mode :
         {FusionMode::kVoxelProjection, FusionMode::kRayCasting, FusionMode::kNormalRayCasting}) {
      const auto mapper = makeProbedMapper(makeCpuParams(mode, directional, 0.04f));
      const bool counts = !directional && mode == FusionMode::kVoxelProjection;
      EXPECT_EQ(mapper->integrate(frame.view()).status,
                counts ? FrameStatus::kFused : FrameStatus::kNoMeasurement)
          << modeName(mode, directional);
      EXPECT_EQ(mapper->stats().blocks > 0, counts);
    }
  }
}

}  // namespace
}  // namespace dtsdf
