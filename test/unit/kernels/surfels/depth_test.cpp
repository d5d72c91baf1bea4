// Tests the conversion of raw values to inverse depths and the filling of gaps between them.
#include "kernels/surfels/depth.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace dtsdf {
namespace depth_test {

constexpr DepthRange kRange{0.001f, 0.1f, 10.0f, 65535.0f, 0.0f};
constexpr DepthNoise kNoise{0.0005f, 0};  // 1/m
const SurfelSettings kSurfels{5, 0.03f, SurfelRules(), 0};

TEST(InverseDepth, IsZeroForInvalidValues) {
  const float nan = std::nanf(""), infinity = std::numeric_limits<float>::infinity();
  for (const float raw : {0.0f, -1.0f, nan, infinity, -infinity, 99.0f, 65535.0f}) {
    EXPECT_EQ(inverseDepth(raw, kRange), 0.0f) << raw;
  }
  EXPECT_FLOAT_EQ(inverseDepth(2000.0f, kRange), 0.5f);
  EXPECT_FLOAT_EQ(inverseDepth(20000.0f, kRange), -0.05f);
}

constexpr int kSide = 7;

/// A small image of inverse depths.
struct Image {
  std::array<float, kSide * kSide> inverse_depth{};

  float& at(int u, int v) { return inverse_depth[v * kSide + u]; }
  void setColumn(int u, float value) {
    for (int v = 0; v < kSide; ++v) at(u, v) = value;
  }
  float filledAt(int u, int v) const {
    const auto at = [&](int column, int row) { return inverse_depth[row * kSide + column]; };
    return filledInverseDepth(at, kSide, kSide, {u, v}, kSurfels, kNoise, 0.0f);
  }
};

/// The inverse depth of a plane is affine in the pixel coordinates.
float onPlane(int u, int v) {
  return 0.8f + 0.004f * static_cast<float>(u) - 0.007f * static_cast<float>(v);
}

/// Every third row and column is empty, as in registered images.
bool isEmptyLine(int at) { return at % 3 == 1; }

TEST(DepthGap, IsFilledWithTheSurroundingPlane) {
  Image image;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      if (!isEmptyLine(u) && !isEmptyLine(v)) image.at(u, v) = onPlane(u, v);
    }
  }
  for (int v = 1; v + 1 < kSide; ++v) {
    for (int u = 1; u + 1 < kSide; ++u) {
      EXPECT_NEAR(image.filledAt(u, v), onPlane(u, v), 1e-6f) << u << ", " << v;
    }
  }
  EXPECT_NEAR(image.filledAt(1, 6), onPlane(1, 6), 1e-6f);
  EXPECT_EQ(image.filledAt(1, 0), -onPlane(2, 0))
      << "a border pixel beside two crossing gaps should stay empty";
}

/// A pixel that stays empty is set to the negative inverse of the nearest depth around it. Its ray
/// is free up to that depth.
TEST(DepthGap, IsNotFilledAcrossADepthEdge) {
  Image image;
  image.setColumn(2, 1.0f);
  image.setColumn(4, 0.96f);  // a jump of 4 %, more than depth_jump
  EXPECT_EQ(image.filledAt(3, 3), -1.0f);
  image.setColumn(4, 0.98f);
  EXPECT_NEAR(image.filledAt(3, 3), 0.99f, 1e-6f);
}

/// A noise-free floor. Its depths have steps of 1 mm, since they are rounded to millimetres.
TEST(DepthGap, IsFilledInRoundedDepths) {
  for (int first_mm = 1000; first_mm < 1100; ++first_mm) {
    const auto measured = [&](int u, int) {
      const double inverse_depth = 1000.0 / first_mm + 0.0037 * u;
      return u == 3 ? 0.0f : static_cast<float>(1.0 / (std::round(1000.0 / inverse_depth) * 0.001));
    };
    const float filled =
        filledInverseDepth(measured, kSide, kSide, {3, 3}, kSurfels, {0.0f, 0}, 0.001f);
    EXPECT_GT(filled, 0.9f) << first_mm;
  }
}

}  // namespace depth_test
}  // namespace dtsdf
