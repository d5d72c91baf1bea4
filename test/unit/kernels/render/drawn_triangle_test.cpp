// Tests which pixels the triangles of a sheet cover.
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

/// Calls visit(u, v, weights) for each pixel that a triangle covers.
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

/// A sheet of small triangles that extends beyond the image on all sides. Many corners lie exactly
/// on pixel centres.
TEST(DrawnTriangle, EachPixelOfASheetIsCoveredOnce) {
  const FrameView frame = cameraAtOrigin();
  constexpr int kSide = 40;
  std::mt19937 random(3);
  const auto near = [&](int at) {  // up to half a pixel away, in quarter pixels
    return (2 * at - 6) * kPixelSteps + (static_cast<int32_t>(random() % 5) - 2) * kPixelSteps / 4;
  };
  std::vector<ProjectedVertex> grid;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int32_t x = near(i % kSide), y = near(i / kSide);
    grid.push_back({x, y, 0.1f, {0.0f, 0.0f, -1.0f}});
  }
  std::vector<int> covered(kSeenWidth * kSeenHeight, 0);
  const auto draw = [&](int a, int b, int c) {
    for (const auto& [p, q] : {std::pair<int, int>{b, c}, {c, b}}) {  // only one winding is drawn
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

}  // namespace drawn_triangle_test
}  // namespace dtsdf
