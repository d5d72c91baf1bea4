// Refined meshes: their tables, the identity of middles, and middles on analytic surfaces.
#include "kernels/meshing/refine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <random>
#include <set>
#include <vector>

#include "kernels/meshing/vertex_normal.h"
#include "support/edge_samples.h"
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

/// Corners 0, 1, 2 and middles 3, 4, 5 behind them; each turns as the triangle does.
TEST(Refinement, MakesFourTrianglesOfOne) {
  std::vector<uint32_t> corners;
  visitFour({0, 1, 2}, {3, 4, 5}, [&](uint32_t vertex) { corners.push_back(vertex); });
  EXPECT_EQ(corners, (std::vector<uint32_t>{0, 3, 5, 1, 4, 3, 2, 5, 4, 3, 4, 5}));
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

/// A field as a block's corners have it; all is known.
struct Field {
  std::function<float(const Vec3f&)> distance;
  Sample sample(const Vec3i& corner, int) const { return {distance(toFloat(corner)), 1.0f}; }
};

struct Distances {
  double straight = 0.0, curved = 0.0;  ///< Root mean squares.
  int middles = 0;
};

/// The vertices of all units of a block, and the distances of the middles between them.
Distances refineBlock(const Field& field) {
  Distances rms;
  const auto endOn = [&](int edge) {
    const Vec3i corner = cornerAt(edgeCorner(edge));
    const int axis = edgeAxis(edge), facing = edgeFacing(edge);
    EdgeSamples samples = {};
    const int d = facedDirection(axis, facing);
    samples.below[d] = field.sample(corner + gridStep(axis, -1), d);
    samples.lower[d] = field.sample(corner, d);
    samples.upper[d] = field.sample(corner + gridStep(axis, 1), d);
    samples.above[d] = field.sample(corner + gridStep(axis, 2), d);
    const Vec3f p = vertexPosition(edge, edgeOffset(MeshRules(), samples, axis, facing));
    return SideEnd{p, vertexNormal(field, edge, p, false)};
  };
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i unit = voxelOffset(i);
    unsigned index = 0;
    for (int c = 0; c < kCubeCorners; ++c) {
      const Vec3i corner = unit + Vec3i{c & 1, c >> 1 & 1, c >> 2 & 1};
      index |= (field.sample(corner, 0).sdf < 0.0f ? 1u : 0u) << c;
    }
    if (index == 255) continue;
    visitSides(kRefineTables, {{static_cast<uint8_t>(index), 0}}, unit, [&](int a, int b) {
      const SideEnd end_a = endOn(a), end_b = endOn(b);
      const float straight = field.distance(0.5f * (end_a.position + end_b.position));
      const float curved = field.distance(middleOfSide(end_a, end_b));
      rms.straight += double(straight) * straight;
      rms.curved += double(curved) * curved;
      ++rms.middles;
    });
  }
  rms.straight = std::sqrt(rms.straight / rms.middles);
  rms.curved = std::sqrt(rms.curved / rms.middles);
  return rms;
}

TEST(Refinement, MiddlesOnABallAreMuchNearerToIt) {
  for (const float side : {1.0f, -1.0f}) {  // from outside, and from within
    const Distances rms = refineBlock({[side](const Vec3f& p) {
      return side * (norm(p - Vec3f{3.9f, 4.2f, 4.1f}) - 3.3f);
    }});
    EXPECT_GT(rms.middles, 500);
    EXPECT_GT(rms.straight, 0.02);
    EXPECT_LT(rms.curved, 0.1 * rms.straight);
  }
}

TEST(Refinement, MiddlesOnASaddleAreMuchNearerToIt) {
  const Distances rms = refineBlock({[](const Vec3f& p) {  // to second order
    const float x = p.x - 4.0f, y = p.y - 4.0f, z = p.z - 4.2f;
    const float slope = std::sqrt(1.0f + (x * x + y * y) / 36.0f);
    return (z - x * y / 6.0f) / slope;
  }});
  EXPECT_GT(rms.middles, 300);
  EXPECT_GT(rms.straight, 0.01);
  EXPECT_LT(rms.curved, 0.2 * rms.straight);
}

TEST(Refinement, MiddlesOfAPlaneLieOnIt) {
  const Vec3f normal = (1.0f / 7.0f) * Vec3f{2.0f, -3.0f, 6.0f};
  const Distances rms = refineBlock({[normal](const Vec3f& p) {
    return dot(normal, p - Vec3f{4.0f, 4.0f, 3.7f});
  }});
  EXPECT_GT(rms.middles, 200);
  EXPECT_LT(rms.straight, 2e-4);  // corners are kept off by the margin
  EXPECT_LT(rms.curved, 2e-4);
}

}  // namespace refine_test
}  // namespace dtsdf
