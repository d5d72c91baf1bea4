// The numbers of the mesh's rules by key.
#include <gtest/gtest.h>

#include "backend/rules.h"

namespace dtsdf {
namespace {

MeshRules readMeshRules(const ParamTree& tree) {
  MeshRules rules;
  ParamReader reader(tree);
  visitRules(rules, reader);
  reader.finish();
  return rules;
}

TEST(MeshRules, EachIsSetByItsKey) {
  const MeshRules rules = readMeshRules({{"rules/mesh/least_weight_share", 0.25},
                                         {"rules/mesh/least_crossing_share", 0.125},
                                         {"rules/mesh/voted_crossing_share", 0.375},
                                         {"rules/mesh/nearness_voxels", 0.5}});
  EXPECT_EQ(rules.least_weight_share, 0.25f);
  EXPECT_EQ(rules.least_crossing_share, 0.125f);
  EXPECT_EQ(rules.voted_crossing_share, 0.375f);
  EXPECT_EQ(rules.nearness_voxels, 0.5f);
}

TEST(MeshRules, DefaultsAreWithinTheirRanges) {
  MeshRules rules;
  ParamWriter writer;
  visitRules(rules, writer);
  EXPECT_EQ(writer.tree.size(), sizeof(MeshRules) / sizeof(float));  // a key for each number
  EXPECT_NO_THROW(readMeshRules(writer.tree));
}

/// A nearness of 0 would divide by 0, and a negative share would mesh what nobody saw.
TEST(MeshRules, WhatNoRuleCouldWorkWithIsRefused) {
  for (const ParamTree& tree : {ParamTree{{"rules/mesh/least_weight_share", -0.1}},
                                ParamTree{{"rules/mesh/least_weight_share", 1.0}},
                                ParamTree{{"rules/mesh/least_crossing_share", -0.1}},
                                ParamTree{{"rules/mesh/voted_crossing_share", 1.5}},
                                ParamTree{{"rules/mesh/nearness_voxels", 0.0}}}) {
    EXPECT_THROW(readMeshRules(tree), ParamError) << tree.begin()->first;
  }
}

}  // namespace
}  // namespace dtsdf
