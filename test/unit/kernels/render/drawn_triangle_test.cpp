// Triangles as a camera sees them, against rays through their planes.
#include "kernels/render/drawn_triangle.h"

#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <vector>

namespace dtsdf {
namespace drawn_triangle_test {

constexpr int kSeenWidth = 64, kSeenHeight = 48;

FrameView cameraAtOrigin() {
  return {kSeenWidth,
          kSeenHeight,
          {50.0f, 52.0f, 31.7f, 23.2f},
          {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}},
          {0, 0, 0},
          0.01f};
}

/// Calls visit(u, v, weights) for all pixels of an image that a triangle covers.
template <class Visit>
void forEachCovered(const DrawnTriangle& drawn, const Visit& visit) {
  if (!drawn.is_drawn) return;
  for (int v = drawn.v0; v <= drawn.v1; ++v) {
    for (int u = drawn.u0; u <= drawn.u1; ++u) {
      const CornerWeights weights = weightsAt(drawn, u - drawn.u0, v - drawn.v0);
      if (covers(drawn, weights)) visit(u, v, weights);
    }
  }
}

TEST(DrawnTriangle, HasTheDepthOfItsPlane) {
  const FrameView frame = cameraAtOrigin();
  const Vec3f a{-2.0f, 1.5f, 9.0f}, b{2.5f, 1.0f, 7.0f}, c{0.3f, -1.7f, 8.0f};
  const SeenVertex seen[3] = {seeVertex(frame, a), seeVertex(frame, b), seeVertex(frame, c)};
  const Vec3f normal = cross(b - a, c - a);
  ASSERT_LT(dot(normal, a), 0.0f) << "faces the camera";
  int covered = 0;
  forEachCovered(drawTriangle(frame, seen[0], seen[1], seen[2]),
                 [&](int u, int v, const CornerWeights& weights) {
                   ++covered;
                   const Vec3f ray = backProject(frame.intrinsics, static_cast<float>(u),
                                                 static_cast<float>(v), 1.0f);
                   const float depth = dot(normal, a) / dot(normal, ray);
                   EXPECT_NEAR(placeOn(seen[0], seen[1], seen[2], weights).depth, depth, 0.01f);
                 });
  EXPECT_GT(covered, 150);
}

TEST(DrawnTriangle, IsDrawnFromItsFrontOnly) {
  const FrameView frame = cameraAtOrigin();
  const SeenVertex a = seeVertex(frame, {-1.0f, 1.0f, 5.0f});
  const SeenVertex b = seeVertex(frame, {1.0f, 1.0f, 5.0f});
  const SeenVertex c = seeVertex(frame, {0.0f, -1.0f, 5.0f});
  EXPECT_TRUE(drawTriangle(frame, a, b, c).is_drawn);
  EXPECT_FALSE(drawTriangle(frame, a, c, b).is_drawn);
  EXPECT_FALSE(drawTriangle(frame, a, b, b).is_drawn);
  const SeenVertex behind = seeVertex(frame, {0.0f, -1.0f, -5.0f});
  EXPECT_FALSE(drawTriangle(frame, a, b, behind).is_drawn);
}

/// A sheet of small triangles beyond all sides of the image, whose corners are often on pixels.
TEST(DrawnTriangle, EachPixelOfASheetIsCoveredOnce) {
  const FrameView frame = cameraAtOrigin();
  constexpr int kSide = 40;
  std::mt19937 random(3);
  const auto near = [&](int at) {  // up to half a pixel off, by quarters
    return (2 * at - 6) * kPixelSteps + (static_cast<int32_t>(random() % 5) - 2) * kPixelSteps / 4;
  };
  std::vector<SeenVertex> grid;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int32_t x = near(i % kSide), y = near(i / kSide);
    grid.push_back({x, y, 0.1f, {0.0f, 0.0f, -1.0f}});
  }
  std::vector<int> covered(kSeenWidth * kSeenHeight, 0);
  const auto draw = [&](int a, int b, int c) {
    for (const auto& [p, q] : {std::pair<int, int>{b, c}, {c, b}}) {  // one of them is its front
      forEachCovered(drawTriangle(frame, grid[a], grid[p], grid[q]),
                     [&](int u, int v, const CornerWeights&) { ++covered[v * kSeenWidth + u]; });
    }
  };
  for (int y = 0; y + 1 < kSide; ++y) {
    for (int x = 0; x + 1 < kSide; ++x) {
      const int at = y * kSide + x;
      draw(at, at + 1, at + kSide);
      draw(at + 1, at + kSide + 1, at + kSide);
    }
  }
  for (int v = 0; v < kSeenHeight; ++v) {
    for (int u = 0; u < kSeenWidth; ++u) ASSERT_EQ(covered[v * kSeenWidth + u], 1) << u << " " << v;
  }
}

TEST(ViewKey, KeepsDepthNormalAndColour) {
  std::mt19937 random(5);
  std::normal_distribution<float> any(0.0f, 1.0f);
  for (int i = 0; i < 1000; ++i) {
    Vec3f normal{any(random), any(random), any(random)};
    const ViewKey key = viewKey(3.25f, packNormal(normal));
    EXPECT_EQ(depthOf(key), 3.25f);
    normal = (1.0f / norm(normal)) * normal;
    EXPECT_LT(norm(normalOf(key) - normal), 1e-4f);
    EXPECT_NEAR(norm(normalOf(key)), 1.0f, 1e-6f);
  }
  const VertexColour colour = colourOf(viewKey(1.0f, packColour({1, 20, 250, 255})));
  EXPECT_EQ(colour.red, 1);
  EXPECT_EQ(colour.green, 20);
  EXPECT_EQ(colour.blue, 250);
  EXPECT_EQ(colour.painted, 255);
  EXPECT_LT(viewKey(1.0f, ~0u), viewKey(1.001f, 0u));
  EXPECT_EQ(depthOf(kNothingSeen), 0.0f);
}

TEST(ColourAt, IsTheMeanOfThePaintedCorners) {
  const VertexColour a{0, 80, 40, 255}, b{120, 0, 80, 255}, c{240, 240, 0, 255};
  const TrianglePlace place{{0.25f, 0.25f, 0.5f}, 1.0f};
  const VertexColour mean = unpackColour(colourAt(a, b, c, place));
  EXPECT_EQ(mean.red, 150);
  EXPECT_EQ(mean.green, 140);
  EXPECT_EQ(mean.blue, 30);
  const VertexColour without = unpackColour(colourAt(a, b, {0, 0, 0, 0}, place));
  EXPECT_EQ(without.red, 60);
  EXPECT_EQ(without.green, 40);
  EXPECT_EQ(without.blue, 60);
  EXPECT_EQ(colourAt({0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}, place) & 255u, 0u);
}

/// Of a block behind the camera, whose middle is 4.5 voxels behind it.
TEST(MayReachView, GoesByTheMiddleOfABlock) {
  const FrameView frame = cameraAtOrigin();
  EXPECT_FALSE(mayReachView(frame, {0, 0, -1}, 4.4f));
  EXPECT_TRUE(mayReachView(frame, {0, 0, -1}, 4.6f));
}

}  // namespace drawn_triangle_test
}  // namespace dtsdf
