// Triangles that anchoring stretches, with lengths worked out by hand.
#include "kernels/meshing/gap.h"

#include <gtest/gtest.h>

#include "backend/gaps.h"

namespace dtsdf {
namespace gap_test {

/// On the upright edge at (x, y), half up, and drawn along x and y.
BlockVertex vertexAt(int x, int y, const Vec3f& drawn = {0.0f, 0.0f, 0.0f}) {
  const Vec3f place{static_cast<float>(x), static_cast<float>(y), 0.5f};
  return {place + drawn, static_cast<uint32_t>(edgeNumber(cornerIndex(x, y, 0), 2, 0))};
}

bool standsInGap(const BlockVertex& a, const BlockVertex& b, const BlockVertex& c) {
  return standsInGap(MeshRules(), a, b, c);
}

TEST(Gap, IsWhereVerticesAreDrawnApart) {
  const BlockVertex left = vertexAt(2, 3, {-0.3f, 0.0f, 0.0f});
  EXPECT_TRUE(standsInGap(left, vertexAt(3, 3, {0.3f, 0.0f, 0.0f}), vertexAt(2, 4)));
  EXPECT_FALSE(standsInGap(left, vertexAt(3, 3, {-0.05f, 0.0f, 0.0f}), vertexAt(2, 4)));
  MeshRules rules;
  rules.most_stretch = 0.65f;
  EXPECT_FALSE(standsInGap(rules, left, vertexAt(3, 3, {0.3f, 0.0f, 0.0f}), vertexAt(2, 4)));
}

/// All vertices beyond an outline are drawn back to it: nearer to those that stay, or side by side.
TEST(Gap, IsNotAtAnOutline) {
  const Vec3f back{-0.8f, 0.0f, 0.0f};
  EXPECT_FALSE(standsInGap(vertexAt(2, 3), vertexAt(3, 3, back), vertexAt(3, 4, back)));
  EXPECT_FALSE(standsInGap(vertexAt(2, 3), vertexAt(3, 3, back), vertexAt(2, 4)));
}

BlockMesh meshWithGap() {
  BlockMesh mesh;
  for (int x = 0; x < 5; ++x) mesh.vertices.push_back(vertexAt(x, 0));
  mesh.triangles = {1, 2, 3, kGapVertex, kGapVertex, kGapVertex, 4, 3, 2};
  return mesh;
}

TEST(Gap, IsDroppedWithTheVerticesThatOnlyItHad) {
  BlockMesh mesh = meshWithGap();
  for (uint8_t i = 0; i < 5; ++i) mesh.colours.push_back({i, i, i, 255});
  dropGaps(mesh);
  EXPECT_EQ(mesh.triangles, (std::vector<uint16_t>{0, 1, 2, 3, 2, 1}));
  ASSERT_EQ(mesh.vertices.size(), 4u);
  ASSERT_EQ(mesh.colours.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(mesh.vertices[i].edge, vertexAt(i + 1, 0).edge);
    EXPECT_EQ(mesh.colours[i].red, i + 1);
  }
}

}  // namespace gap_test
}  // namespace dtsdf
