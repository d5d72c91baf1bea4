// Rules on a row of mesh units at once against the same rules on one after the other.
#include "cpu/lanes.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/meshing/sheets.h"

namespace dtsdf {
namespace {

/// Units that have nothing to do with each other.
struct UnrelatedUnits {
  using Real = LaneFloats;
  using Bits = LaneInts;
  static constexpr int kUnits = kLanes;

  UnitSamples unit[kLanes];

  LaneFloats sdf(int d, int c) const {
    float values[kLanes];
    for (int k = 0; k < kLanes; ++k) values[k] = unit[k].sdf(d, c);
    return LaneFloats::load(values);
  }
  LaneFloats weight(int d, int c) const {
    float values[kLanes];
    for (int k = 0; k < kLanes; ++k) values[k] = unit[k].weight(d, c);
    return LaneFloats::load(values);
  }
  bool isObserved(int) const { return true; }
  bool maySpeak(int) const { return true; }
};

/// A noisy plane in the directions it belongs to and now and then in others, with gaps.
UnitSamples randomUnit(std::mt19937& random) {
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  Vec3f n{normal(random), normal(random), normal(random)};
  n = (1.0f / norm(n)) * n;
  const float offset = dot(n, {0.5f, 0.5f, 0.5f}) + 0.5f * normal(random);
  UnitSamples samples = {};
  for (int d = 0; d < kDirectionCount; ++d) {
    const bool belongs = directionWeight(n, d) > 0.0f;
    if (!belongs && uniform(random) < 0.7f) continue;
    for (int c = 0; c < kCubeCorners; ++c) {
      const Vec3f p{static_cast<float>(c & 1), static_cast<float>(c >> 1 & 1),
                    static_cast<float>(c >> 2 & 1)};
      const float distance = (belongs ? 1.0f : -1.0f) * (dot(n, p) - offset);
      if (uniform(random) < 0.02f) continue;
      samples.corner[d][c] = {distance + 0.2f * normal(random), 20.0f * uniform(random)};
    }
  }
  return samples;
}

TEST(Lanes, UnitsAreIndexedAsEachOnItsOwn) {
  for (const bool directional : {true, false}) {
    std::mt19937 random(7);
    int surfaces = 0, second_sheets = 0;
    for (int trial = 0; trial < 10000; ++trial) {
      UnrelatedUnits units;
      for (UnitSamples& unit : units.unit) unit = randomUnit(random);
      UnitLabels together[kLanes];
      labelUnits(kMeshTables, MeshRules(), units, directional, together);
      for (int k = 0; k < kLanes; ++k) {
        const UnitLabels alone = labelUnit(kMeshTables, MeshRules(), units.unit[k], directional);
        ASSERT_EQ(together[k].behind_first, alone.behind_first) << "trial " << trial;
        ASSERT_EQ(together[k].in_front_of_last, alone.in_front_of_last) << "trial " << trial;
        surfaces += isSurface(alone.behind_first);
        second_sheets += indicesOf(alone).sheet[1] != 0;
      }
    }
    EXPECT_GT(surfaces, 100);
    EXPECT_EQ(second_sheets > 0, directional);
  }
}

}  // namespace
}  // namespace dtsdf
