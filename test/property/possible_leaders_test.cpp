// Random mesh units: the rule that spares the index stage a look at a unit never spares a surface.
#include "kernels/meshing/possible_leaders.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/meshing/sheets.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

/// Mostly what fusion leaves of a plane through the unit, with gaps in each direction, so that many
/// corners have one observer or none; now and then a direction with the plane's back, or with
/// noise.
UnitSamples drawUnit(std::mt19937& random) {
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

struct Counts {
  int surfaces = 0, spared_with_speaker = 0;
};

constexpr int kCases = 20, kUnitsPerCase = 2500;

/// Calls check(samples, sides, labels) for random units, until it fails.
template <class Check>
Counts checkUnits(bool directional, const MeshRules& rules, const Check& check) {
  Counts counts;
  for (int n = 0; n < kCases; ++n) {
    const uint32_t seed = caseSeed(n);
    SCOPED_TRACE(describeSeed(seed));
    std::mt19937 random(seed);
    for (int i = 0; i < kUnitsPerCase; ++i) {
      const UnitSamples samples = drawUnit(random);
      const uint32_t sides = sidesOfUnit(samples, directional ? kDirectionCount : 1);
      const UnitLabels labels = labelUnit(kMeshTables, rules, samples, directional);
      check(samples, sides, labels);
      counts.surfaces += isSurface(labels.behind_first);
      counts.spared_with_speaker += possibleLeaders(sides) == 0 && mayBeSpeaking(sides) != 0;
      if (testing::Test::HasFailure()) return counts;
    }
  }
  return counts;
}

class PossibleLeaders : public testing::TestWithParam<float> {
 protected:
  MeshRules rules() const {
    MeshRules rules;
    rules.least_weight_share = GetParam();
    return rules;
  }
};

TEST_P(PossibleLeaders, AUnitWithoutOneIsEmpty) {
  const Counts counts =
      checkUnits(true, rules(), [](const UnitSamples&, uint32_t sides, const UnitLabels& labels) {
        EXPECT_TRUE(possibleLeaders(sides) != 0 || saysNothing(labels));
      });
  EXPECT_GT(counts.surfaces, 1000);
  EXPECT_GT(counts.spared_with_speaker, 1000);
}

/// Of each sheet, not of the unit as a whole: whoever leads one is among the possible leaders.
TEST_P(PossibleLeaders, ASheetsLeaderIsOne) {
  const MeshRules numbers = rules();
  const Counts counts =
      checkUnits(true, numbers, [&](const UnitSamples& samples, uint32_t sides, const UnitLabels&) {
        const VoteLimits<float> limits = makeVoteLimits(numbers, samples);
        for (const int32_t leader : findLeaders(samples, limits.least_weight).direction) {
          if (sheetLabels(samples, leader, limits) == kNotKnown) continue;
          EXPECT_TRUE(possibleLeaders(sides) >> leader & 1) << "direction " << leader;
        }
      });
  EXPECT_GT(counts.surfaces, 1000);
}

TEST_P(PossibleLeaders, ADirectionThatMayNotSpeakDoesNot) {
  const MeshRules numbers = rules();
  checkUnits(true, numbers, [&](const UnitSamples& samples, uint32_t sides, const UnitLabels&) {
    const float least_weight = makeVoteLimits(numbers, samples).least_weight;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (mayBeSpeaking(sides) >> d & 1) continue;
      EXPECT_EQ(directionConfidence(samples, d, least_weight), 0.0f) << "direction " << d;
    }
  });
}

TEST_P(PossibleLeaders, AnUndirectedUnitWithoutOneIsEmpty) {
  const Counts counts =
      checkUnits(false, rules(), [](const UnitSamples&, uint32_t sides, const UnitLabels& labels) {
        EXPECT_TRUE(possibleLeaders(sides) != 0 || saysNothing(labels));
      });
  EXPECT_GT(counts.surfaces, 100);
  EXPECT_GT(counts.spared_with_speaker, 100);
}

INSTANTIATE_TEST_SUITE_P(SharesOfWeight, PossibleLeaders,
                         testing::Values(0.0f, MeshRules().least_weight_share, 0.3f));

}  // namespace
}  // namespace dtsdf
