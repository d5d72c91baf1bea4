#include "evaluation/depth_comparison.h"

#include <gtest/gtest.h>

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

TEST(DepthComparison, NothingMeasured) {
  const DepthComparison comparison(1);
  EXPECT_EQ(comparison.coveredShare(), 0.0);
  EXPECT_EQ(comparison.errors().count, 0u);
}

}  // namespace
}  // namespace dtsdf
