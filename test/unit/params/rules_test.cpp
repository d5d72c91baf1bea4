// Tests that each rule parameter can be set by its key.
#include <gtest/gtest.h>

#include "backend/rule_settings.h"
#include "backend/rules.h"

namespace dtsdf {
namespace {

Rules readRules(const ParamTree& tree) {
  Rules rules;
  ParamReader reader(tree);
  visitRules(rules, reader);
  reader.finish();
  return rules;
}

ParamTree treeOf(Rules rules) {
  ParamWriter writer;
  visitRules(rules, writer);
  return writer.tree;
}

/// Each key sets exactly one rule parameter. All rule parameters have four bytes, and all but one
/// have a key. The one without a key is computed from a setting.
TEST(Rules, EachKeySetsOneNumber) {
  const ParamTree defaults = treeOf(Rules());
  EXPECT_EQ(defaults.size() + 1, sizeof(Rules) / sizeof(float));
  EXPECT_EQ(treeOf(readRules(defaults)), defaults);
  for (const auto& [key, value] : defaults) {
    ParamTree changed = defaults;
    if (const int* whole = std::get_if<int>(&value)) {
      changed[key] = *whole + 1;
    } else {
      changed[key] = 0.5 * std::get<double>(value);
    }
    EXPECT_EQ(treeOf(readRules(changed)), changed) << key;
  }
}

/// Values of 0 would cause divisions by 0. A surface that gains no evidence would never appear.
TEST(Rules, UnusableValuesAreRefused) {
  EXPECT_THROW(readRules({{"rules/surfels/largest_noise_turn", 0.0}}), ParamError);
  EXPECT_THROW(readRules({{"rules/fusion/sample_reach", 0.0}}), ParamError);
  EXPECT_THROW(readRules({{"rules/fusion/full_weight_depth_m", 0.0}}), ParamError);
  EXPECT_THROW(readRules({{"rules/fusion/look_turns", 0}}), ParamError);
  EXPECT_THROW(readRules({{"rules/fusion/support_gain", 0}}), ParamError);
}

TEST(FusionRules, MaxEvidenceDependsOnMemoryFrames) {
  const auto maxWith = [](int frames) {
    MapperParams params;
    params.fusion.memory_frames = frames;
    return withMemory(Rules(), params).fusion.max_evidence;
  };
  EXPECT_EQ(maxWith(0), 24);
  EXPECT_EQ(maxWith(20), 60);
  EXPECT_EQ(maxWith(42), 126);  // evidence is stored as a signed byte
}

/// A nearness of 0 would cause a division by 0. A negative weight fraction would mesh unmeasured
/// surfaces.
TEST(MeshRules, UnusableValuesAreRefused) {
  EXPECT_THROW(readRules({{"rules/mesh/min_weight_share", -0.1}}), ParamError);
  EXPECT_THROW(readRules({{"rules/mesh/min_weight_share", 1.0}}), ParamError);
  EXPECT_THROW(readRules({{"rules/mesh/min_crossing_share", -0.1}}), ParamError);
  EXPECT_THROW(readRules({{"rules/mesh/voted_crossing_share", 1.5}}), ParamError);
  EXPECT_THROW(readRules({{"rules/mesh/nearness_voxels", 0.0}}), ParamError);
}

}  // namespace
}  // namespace dtsdf
