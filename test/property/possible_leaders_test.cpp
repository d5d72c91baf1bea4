// Tests, on random mesh units (cells of marching cubes), that possibleLeaders() returns 0 only for
// units without a surface. Mesh extraction skips these units.
#include "kernels/meshing/possible_leaders.h"

#include <gtest/gtest.h>

#include <random>

#include "support/random_seed.h"
#include "support/unit_samples.h"

namespace dtsdf {
namespace {

/// Mostly samples of a plane through the unit, as fusion produces them. Some samples are missing,
/// so many corners are known in at most one direction. Some directions contain the back of the
/// plane, or noise.
UnitSamples randomUnitSamples(std::mt19937& random) {
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  const int axis = static_cast<int>(random() % 3);
  const float gap = random() % 2 == 0 ? 0.05f : 0.5f;
  UnitSamples samples = {};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directionAxis(d) != axis && uniform(random) < 0.6f) continue;
    const float slope = (uniform(random) < 0.9f ? 1.0f : -1.0f) * directionSign(d);
    const float offset = 0.5f + 0.3f * normal(random), noise = uniform(random) < 0.2f ? 1.0f : 0.1f;
    for (int c = 0; c < kCubeCorners; ++c) {
      if (uniform(random) < gap) continue;
      const float at = static_cast<float>(c >> directionAxis(d) & 1) - offset;
      const float weight = uniform(random) < 0.1f ? -1.0f : 10.0f * uniform(random);
      samples.corner[d][c] = {slope * at + noise * normal(random), weight};
    }
  }
  return samples;
}

uint32_t sidesOfUnit(const UnitSamples& samples, int directions) {
  uint32_t unit = 0;
  for (int c = 0; c < kCubeCorners; ++c) {
    uint32_t corner = 0;
    for (int d = 0; d < directions; ++d) {
      corner |= sidesOfSample(d, samples.sdf(d, c), samples.weight(d, c));
    }
    unit |= sidesOfCorner(corner);
  }
  return unit;
}

constexpr int kCases = 20, kUnitsPerCase = 2500;

class PossibleLeaders : public testing::TestWithParam<float> {
 protected:
  MeshRules rules() const {
    MeshRules rules;
    rules.min_weight_share = GetParam();
    return rules;
  }
};

/// Tests units of directional and undirected maps.
TEST_P(PossibleLeaders, AUnitWithoutALeaderIsEmpty) {
  for (const bool directional : {true, false}) {
    int surfaces = 0, skipped_active = 0;
    for (int n = 0; n < kCases; ++n) {
      const uint32_t seed = caseSeed(n);
      SCOPED_TRACE(describeSeed(seed));
      std::mt19937 random(seed);
      for (int i = 0; i < kUnitsPerCase; ++i) {
        const UnitSamples samples = randomUnitSamples(random);
        const uint32_t sides = sidesOfUnit(samples, directional ? kDirectionCount : 1);
        const UnitLabels labels = labelUnit(kMeshTables, rules(), samples, directional);
        ASSERT_TRUE(possibleLeaders(sides) != 0 || isEmpty(labels));
        surfaces += isSurface(labels.behind_first);
        skipped_active += possibleLeaders(sides) == 0 && possiblyActive(sides) != 0;
      }
    }
    EXPECT_GT(surfaces, 100);
    EXPECT_GT(skipped_active, 100);
  }
}

INSTANTIATE_TEST_SUITE_P(SharesOfWeight, PossibleLeaders,
                         testing::Values(0.0f, MeshRules().min_weight_share, 0.3f));

}  // namespace
}  // namespace dtsdf
