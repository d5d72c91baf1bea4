#include "kernels/meshing/vote.h"

#include <gtest/gtest.h>

#include "support/unit_samples.h"

namespace dtsdf {
namespace vote_test {

constexpr int kNobody = -1;

/// A unit whose corners are all the same to a direction.
void setAll(UnitSamples& samples, int direction, const Sample& voxel) {
  for (Sample& corner : samples.corner[direction]) corner = voxel;
}

/// With a nearness of 0.25:
///   0.75 by a weight of 2 counts (2 / 1)^2 = 4, -0.25 by 1.5 counts (1.5 / 0.5)^2 = 9,
///   so the corner is at (4 * 0.75 - 9 * 0.25) / 13 = 0.75 / 13.
TEST(Vote, TwoDirectionsByHand) {
  CornerVote<float> vote;
  EXPECT_EQ(votedSdf(vote), 0.0f);
  castVote(vote, 0.75f, 2.0f, true, 0.25f);
  EXPECT_EQ(votedSdf(vote), 0.75f);
  castVote(vote, -0.25f, 1.5f, true, 0.25f);
  EXPECT_EQ(vote.votes, 13.0f);
  EXPECT_EQ(vote.weight, 3.5f);
  EXPECT_FLOAT_EQ(votedSdf(vote), 0.75f / 13.0f);
}

/// Weights of all voters count together: 0.6 and 0.6 are more than 1, 0.6 and 0.4 are not.
TEST(Vote, ACornerNeedsMoreThanTheLeastWeight) {
  UnitSamples samples = {};
  setAll(samples, 0, {-0.4f, 0.6f});
  setAll(samples, 2, {-0.4f, 0.6f});
  const VoteLimits<float> limits{9.0f, 1.0f, 0.2f};
  EXPECT_EQ(voteOnCorners(samples, kNobody, limits), 255);
  samples.corner[2][5].weight = 0.4f;
  EXPECT_EQ(voteOnCorners(samples, kNobody, limits), kNotKnown);
}

TEST(Vote, TheLeastWeightIsAShareOfTheGreatest) {
  UnitSamples samples = {};
  samples.corner[3][6] = {0.0f, 8.0f};
  samples.corner[0][1] = {0.0f, 2.0f};
  MeshRules rules;
  rules.least_weight_share = 0.25f;
  rules.nearness_voxels = 0.5f;
  const VoteLimits<float> limits = makeVoteLimits(rules, samples);
  EXPECT_EQ(limits.greatest_weight, 8.0f);
  EXPECT_EQ(limits.least_weight, 2.0f);
  EXPECT_EQ(limits.nearness, 0.5f);
  EXPECT_FLOAT_EQ(makeVoteLimits(MeshRules(), samples).least_weight, 0.024f);
}

}  // namespace vote_test
}  // namespace dtsdf
