#include "evaluation/depth_comparison.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace dtsdf {
namespace {

ViewCamera smallCamera() { return {{4, 4, 1.5f, 0.5f}, 4, 2}; }

/// In the first image, one pixel is not measured, and the mesh has a hole at another pixel. At the
/// remaining pixels, the mesh is off by -70 and -40 mm at 1 m, -70 and +70 mm at 2 m, +60 mm at 1
/// m, and +300 mm (3 %) at 10 m. In the second image, only one pixel is measured, and the mesh is
/// off by 0.5 m.
TEST(DepthComparison, GivesKnownFiguresForMergedImages) {
  DepthComparison all(1), other(1);
  all.add({1, 1, 2, 2, 1, 10, 1, 0}, {0.93f, 0.96f, 1.93f, 2.07f, 1.06f, 10.3f, 0, 1},
          smallCamera());
  other.add({1, 0, 0, 0, 0, 0, 0, 0}, {1.5f, 1, 1, 1, 0, 0, 0, 0}, smallCamera());
  all.merge(other);
  const nlohmann::json json = nlohmann::json::parse(all.toJson());
  EXPECT_EQ(json.at("images"), 2);
  EXPECT_EQ(json.at("measured_pixels"), 8);
  EXPECT_EQ(json.at("covered_share"), 7.0 / 8.0);
  EXPECT_EQ(json.at("share_within_1_percent"), 0.0);
  EXPECT_EQ(json.at("share_within_5_percent"), 4.0 / 8.0);
  EXPECT_EQ(json.at("share_in_front_5_percent"), 1.0 / 8.0);
  EXPECT_EQ(json.at("share_behind_5_percent"), 2.0 / 8.0);
  EXPECT_NEAR(json.at("mean_mm").get<double>(), 1110.0 / 7.0, 1e-3);
  EXPECT_EQ(json.at("max_mm"), 500.0);
}

}  // namespace
}  // namespace dtsdf
