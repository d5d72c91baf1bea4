#include "evaluation/depth_comparison.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace dtsdf {
namespace {

ViewCamera smallCamera() { return {{4, 4, 1.5f, 0.5f}, 4, 2}; }

TEST(DepthComparison, KnownAnswers) {
  DepthComparison comparison(1);
  // A hole in the image, one in the mesh, and errors of 0, 10, 30 and 100 mm.
  comparison.add({0, 1, 1, 1, 2, 2, 0, 0}, {1, 0, 1, 1.01f, 2.03f, 1.9f, 0, 3}, smallCamera());
  EXPECT_EQ(comparison.images(), 1u);
  EXPECT_EQ(comparison.measuredPixels(), 5u);
  EXPECT_DOUBLE_EQ(comparison.coveredShare(), 0.8);
  EXPECT_NEAR(comparison.errors().mean_m, 0.035, 1e-6);
  EXPECT_NEAR(comparison.errors().max_m, 0.1, 1e-6);
  EXPECT_DOUBLE_EQ(comparison.shareWithin(0.02), 0.6);
  EXPECT_DOUBLE_EQ(comparison.shareWithin(0.5), 0.8) << "a hole in the mesh is never within";
}

TEST(DepthComparison, SkipsPixelsAndMerges) {
  DepthComparison a(2), b(2);
  a.add({1, 9, 1, 9, 9, 9, 9, 9}, {1, 1, 1, 1, 1, 1, 1, 1}, smallCamera());
  b.add({1, 9, 0, 9, 9, 9, 9, 9}, {2, 1, 1, 1, 1, 1, 1, 1}, smallCamera());
  a.merge(b);
  EXPECT_EQ(a.images(), 2u);
  EXPECT_EQ(a.measuredPixels(), 3u);
  EXPECT_DOUBLE_EQ(a.errors().max_m, 1.0);
}

/// Of eight pixels one is not measured and one shows a hole. The mesh is off by -70 and -40 mm at
/// 1 m, by -70 and +70 at 2 m, by +60 at 1 m and by +300 at 10 m, which is 3 %.
TEST(DepthComparison, TellsInFrontFromBehind) {
  DepthComparison comparison(1);
  comparison.add({1, 1, 2, 2, 1, 10, 1, 0}, {0.93f, 0.96f, 1.93f, 2.07f, 1.06f, 10.3f, 0, 1},
                 smallCamera());
  EXPECT_EQ(comparison.measuredPixels(), 7u);
  EXPECT_DOUBLE_EQ(comparison.shareInFront(0.05), 1.0 / 7.0);
  EXPECT_DOUBLE_EQ(comparison.shareInFront(0.039), 2.0 / 7.0);
  EXPECT_DOUBLE_EQ(comparison.shareInFrontBy(0.065), 2.0 / 7.0);
  EXPECT_DOUBLE_EQ(comparison.shareBehind(0.05), 1.0 / 7.0);
  EXPECT_DOUBLE_EQ(comparison.shareBehindBy(0.065), 2.0 / 7.0);
  const double outside = comparison.shareInFront(0.05) + comparison.shareBehind(0.05);
  EXPECT_NEAR(comparison.shareWithin(0.05) + outside, comparison.coveredShare(), 1e-12);
}

/// What a merged comparison tells in front stays in front.
TEST(DepthComparison, TellsThemByKeyAfterMerging) {
  DepthComparison a(1), b(1);
  a.add({1, 1, 1, 1, 0, 0, 0, 0}, {0.5f, 1, 1, 1, 0, 0, 0, 0}, smallCamera());
  b.add({1, 1, 1, 1, 0, 0, 0, 0}, {1.5f, 1.5f, 1, 1, 0, 0, 0, 0}, smallCamera());
  a.merge(b);
  const nlohmann::json json = nlohmann::json::parse(a.toJson());
  EXPECT_EQ(json.at("share_in_front_5_percent"), 0.125);
  EXPECT_EQ(json.at("share_in_front_65_mm"), 0.125);
  EXPECT_EQ(json.at("share_behind_5_percent"), 0.25);
  EXPECT_EQ(json.at("share_behind_65_mm"), 0.25);
  EXPECT_EQ(json.at("share_within_5_percent"), 0.625);
  EXPECT_EQ(json.at("max_mm"), 500.0);
}

}  // namespace
}  // namespace dtsdf
