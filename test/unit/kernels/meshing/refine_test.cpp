// Refined meshes: their tables, and the identity and place of middles.
#include "kernels/meshing/refine.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>
#include <vector>

#include "kernels/meshing/edge_vertex.h"
#include "support/random_vectors.h"

namespace dtsdf {
namespace refine_test {

bool sameBits(const Vec3f& a, const Vec3f& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

TEST(RefineTables, TrianglesNameTheirSides) {
  for (int index = 0; index < 256; ++index) {
    for (int t = 0; t < kMeshTables.triangle_count[index]; ++t) {
      const uint8_t* corner = kMeshTables.triangle_edge[index] + 3 * t;
      for (int k = 0; k < 3; ++k) {
        const int side = kRefineTables.triangle_side[index][3 * t + k];
        ASSERT_LT(side, kRefineTables.side_count[index]);
        const uint8_t* ends = kRefineTables.side_edge[index] + 2 * side;
        EXPECT_EQ((std::set<int>{ends[0], ends[1]}),
                  (std::set<int>{corner[k], corner[(k + 1) % 3]}));
      }
    }
  }
}

/// A fan of n - 2 triangles has 2 n - 3 sides: two for each triangle and one more for each fan.
TEST(RefineTables, EachSideIsThereOnce) {
  int most = 0;
  for (int index = 0; index < 256; ++index) {
    const int sides = kRefineTables.side_count[index];
    EXPECT_EQ(sides, 2 * kMeshTables.triangle_count[index] + kMeshTables.component_count[index]);
    most = std::max(most, sides);
  }
  EXPECT_EQ(most, kMaxSides);
}

TEST(Middle, IsIdentifiedByItsTwoEdges) {
  EXPECT_EQ(kFirstMiddle, 4374u);  // as dtsdf_mapping/block_mesh.h says
  EXPECT_FALSE(isMiddle(kGridEdges - 1));
  for (const auto& [a, b] : {std::pair<int, int>{0, 1}, {17, 4373}, {4372, 4373}}) {
    const uint32_t number = middleNumber(a, b);
    EXPECT_EQ(number, 4374u + 4374u * static_cast<uint32_t>(a) + static_cast<uint32_t>(b));
    EXPECT_EQ(number, middleNumber(b, a));
    EXPECT_TRUE(isMiddle(number));
    EXPECT_EQ(middleFirst(number), a);
    EXPECT_EQ(middleSecond(number), b);
  }
}

/// By hand: normals (-0.6, 0.8) and (0.6, 0.8) at (0, 0) and (2.5, 0) give 1/8 of
/// 1.5 (0.6, 0.8) + 1.5 (-0.6, 0.8) = (0, 2.4), that is 0.3: 19660.8 steps of 2^-16, rounded.
TEST(Middle, IsThatOfTheCubicWithTheseNormals) {
  const SideEnd a{{2.0f, 3.0f, 4.0f}, {-0.6f, 0.8f, 0.0f}};
  const SideEnd b{{4.5f, 3.0f, 4.0f}, {0.6f, 0.8f, 0.0f}};
  const Vec3f middle = middleOfSide(a, b);
  EXPECT_EQ(middle.x, 3.25f);
  EXPECT_EQ(middle.y, 3.0f + 19661.0f / 65536.0f);
  EXPECT_EQ(middle.z, 4.0f);
}

TEST(Middle, OfAnEndWithoutNormalHasTheOthersShareOnly) {
  const SideEnd a{{2.0f, 3.0f, 4.0f}, {0.0f, 0.0f, 0.0f}};
  const SideEnd b{{3.0f, 3.0f, 4.0f}, {0.6f, 0.8f, 0.0f}};
  EXPECT_NEAR(middleOfSide(a, b).x, 2.5f + 0.125f * 0.36f, 1e-5f);
  EXPECT_NEAR(middleOfSide(a, b).y, 3.0f + 0.125f * 0.48f, 1e-5f);
  EXPECT_TRUE(sameBits(middleOfSide(a, {b.position, a.normal}), {2.5f, 3.0f, 4.0f}));
}

/// Neither the order of the ends nor the block that a face is seen from shows; no middle is farther
/// from the straight side than a quarter of it.
TEST(Middle, IsTheSameFromBothEndsAndBothBlocks) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(0.0f, 8.0f);
  std::uniform_int_distribution<int> shift(-4096, 4096);
  for (int trial = 0; trial < 20000; ++trial) {
    // By a face across x, from which borders may have moved the ends by multiples of 2^-12.
    SideEnd a{{static_cast<float>(shift(random)) / 4096.0f, place(random), place(random)},
              randomUnit(random)};
    SideEnd b{{static_cast<float>(shift(random)) / 4096.0f, place(random), place(random)},
              randomUnit(random)};
    const Vec3f here = middleOfSide(a, b);
    ASSERT_TRUE(sameBits(here, middleOfSide(b, a)));
    const Vec3f straight = 0.5f * (a.position + b.position);
    ASSERT_LE(norm(here - straight), 0.25f * norm(b.position - a.position) + 1e-4f);
    a.position.x += 8.0f;
    b.position.x += 8.0f;
    const Vec3f there = middleOfSide(a, b);
    ASSERT_EQ(double(there.x), 8.0 + double(here.x));
    ASSERT_TRUE(sameBits({here.x, there.y, there.z}, here));
  }
}

/// Two sheets with several triangles each: where middles are straight, every triangle is cut into
/// four of a quarter of its area.
TEST(Refinement, CutsEveryTriangleIntoQuarters) {
  const Vec3i unit{3, 1, 6};
  for (int index = 1; index < 255; ++index) {
    const UnitIndices indices{{static_cast<uint8_t>(index), static_cast<uint8_t>(255 - index)}};
    std::vector<Vec3f> position(kGridEdges);
    std::vector<Vec3f> coarse;
    visitTriangleEdges(kMeshTables, indices, unit, [&](int edge) {
      position[static_cast<size_t>(edge)] = vertexPosition(edge, 0.25f);
      coarse.push_back(position[static_cast<size_t>(edge)]);
    });
    const Vec3f none{0.0f, 0.0f, 0.0f};
    visitSides(kRefineTables, indices, unit, [&](int a, int b) {
      position.push_back(middleOfSide({position[static_cast<size_t>(a)], none},
                                      {position[static_cast<size_t>(b)], none}));
    });
    EXPECT_EQ(position.size(), kGridEdges + sidesOfUnit(kRefineTables, indices));
    std::vector<Vec3f> fine;
    visitRefinedTriangles(
        kMeshTables, kRefineTables, indices, unit, kGridEdges,
        [](int edge) { return static_cast<uint32_t>(edge); },
        [](const uint32_t(&)[3]) { return false; },
        [&](uint32_t vertex) { fine.push_back(position[vertex]); });
    ASSERT_EQ(fine.size(), 4 * coarse.size());
    const auto area = [](const Vec3f* t) { return cross(t[1] - t[0], t[2] - t[0]); };
    for (size_t i = 0; i < fine.size(); i += 3) {
      const Vec3f quarter = 0.25f * area(&coarse[i / 12 * 3]);
      EXPECT_LT(norm(area(&fine[i]) - quarter), 1e-6f);
    }
  }
}

}  // namespace refine_test
}  // namespace dtsdf
