// Vertices held to what was measured, with shifts worked out by hand.
#include "kernels/meshing/anchoring.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "support/edge_samples.h"

namespace dtsdf {
namespace anchoring_test {

constexpr int kXPlus = 0, kZPlus = 4, kZMinus = 5;
constexpr int kAxis = 2, kFacing = 0;  // along z, the surface faces Z+
constexpr float kOffset = 0.4f;
constexpr float kStep = 0.026f;  // half a step of an anchor's offset, and rounding

/// An edge whose crossing is told by some directions, with anchors.
struct AnchoredEdge {
  EdgeSamples samples = {};
  std::map<std::pair<int, int>, uint16_t> anchor;  ///< By end and direction.

  void cross(int direction, float weight = 1.0f) {
    samples.lower[direction] = {-kOffset, weight};
    samples.upper[direction] = {1.0f - kOffset, weight};
  }
  void put(int end, int direction, const Vec3f& offset) {
    anchor[{end, direction}] = packAnchor(offset, 0.5f);
  }
  Vec3f shift(const MeshSettings& rules = MeshSettings()) const {
    const auto anchors = [this](int end, int direction) {
      const auto at = anchor.find({end, direction});
      return at == anchor.end() ? kNoAnchor : at->second;
    };
    return anchoringShift(rules, samples, crossingDirections(samples, kAxis, kFacing), anchors,
                          kAxis, kFacing, kOffset);
  }
};

void expectNear(const Vec3f& a, const Vec3f& b, float tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

/// The point is 0.9 away in x, at the height of the vertex; of 0.8 of that, 7 / 8.
TEST(Anchoring, DrawsAVertexToWhereItsSurfaceWasMeasured) {
  AnchoredEdge edge;
  edge.cross(kZPlus);
  edge.put(0, kZPlus, {-0.9f, 0.0f, 0.4f});
  expectNear(edge.shift(), {-0.7f, 0.0f, 0.0f}, kStep);
  MeshSettings rules;
  rules.measured_pull = 0.5f;
  expectNear(edge.shift(rules), {-0.4f, 0.0f, 0.0f}, kStep);
}

/// The foot of the lower corner is 0.4 below the vertex' surface, which makes a gap of the root of
/// 0.325^2 + 0.425^2 - 0.45^2 = 0.289 with a step to spare, that of the upper corner less. The gap
/// is 0.929 of the way from 0.15 to twice that; 0.326 from the point, 0.693 are beyond reach.
TEST(Anchoring, BeginsGradually) {
  AnchoredEdge edge;
  edge.cross(kZPlus);
  edge.put(0, kZPlus, {0.125f, 0.0f, 0.425f});
  edge.put(1, kZPlus, {0.125f, 0.0f, -0.575f});
  expectNear(edge.shift(), {0.0f, 0.0f, 0.0f}, 0.0f);
  edge.put(0, kZPlus, {0.325f, 0.025f, 0.425f});
  edge.put(1, kZPlus, {0.325f, 0.025f, -0.575f});
  const float share = 0.875f * 0.929f * 0.693f;
  expectNear(edge.shift(), {share * 0.325f, share * 0.025f, share * 0.025f}, 0.005f);
}

TEST(Anchoring, WithinReachNothingMoves) {
  AnchoredEdge edge;
  edge.cross(kZPlus);
  edge.put(0, kZPlus, {0.025f, 0.0f, 0.425f});  // the upper end's foot was not measured
  expectNear(edge.shift(), {0.0f, 0.0f, 0.0f}, 0.0f);
  MeshSettings rules;
  rules.measured_reach = 0.02f;
  EXPECT_GT(edge.shift(rules).x, 0.0f);
}

/// Neither that which does not cross, nor the one that faces against the surface, nor an end that
/// is unknown.
TEST(Anchoring, OnlyDirectionsThatTellTheCrossingCount) {
  AnchoredEdge edge;
  edge.cross(kZPlus);
  edge.put(0, kZPlus, {-0.9f, 0.0f, 0.4f});
  edge.samples.lower[kXPlus] = {0.3f, 5.0f};
  edge.samples.upper[kXPlus] = {0.5f, 5.0f};
  edge.put(0, kXPlus, {0.0f, 0.0f, 0.4f});
  edge.cross(kZMinus, 5.0f);
  edge.put(0, kZMinus, {0.0f, 0.0f, 0.4f});
  expectNear(edge.shift(), {-0.7f, 0.0f, 0.0f}, kStep);
  edge.samples.lower[kZPlus].weight = 0.0f;  // then nothing crosses on its own
  edge.put(1, kZPlus, {0.0f, 0.9f, -0.6f});
  edge.anchor.erase({0, kXPlus});
  expectNear(edge.shift(), {0.0f, 0.7f, 0.0f}, kStep);
}

/// Blocks on both sides of a face give the vertex other coordinates, 8 and 0, and the same shift.
TEST(Anchoring, BlocksAgreeAboutVerticesOnTheirFaces) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(-0.97f, 0.97f);
  for (int i = 0; i < 10000; ++i) {
    AnchoredEdge edge;
    edge.cross(kZPlus);
    edge.put(0, kZPlus, {uniform(random), uniform(random), uniform(random)});
    const Vec3f shift = edge.shift();
    ASSERT_EQ((8.0f + shift.x) - 8.0f, 0.0f + shift.x);
    ASSERT_EQ((8.0f + shift.y) - 8.0f, 0.0f + shift.y);
    ASSERT_EQ((8.0f + shift.z) - 8.0f, 0.0f + shift.z);
  }
}

}  // namespace anchoring_test
}  // namespace dtsdf
