// Tests where the vertices of a mesh's outline move, and which holes are closed.
#include "meshing/outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

#include "dtsdf_mapping/mesh.h"
#include "kernels/core/vec.h"
#include "support/mesh_topology.h"

namespace dtsdf {
namespace {

using Kind = Outline::Kind;
using Triangle = std::array<uint32_t, 3>;

constexpr uint32_t kColumns = 20, kRows = 5;

/// A sheet of squares, each split into two triangles. Vertices are numbered at random because
/// nothing may depend on the numbers.
struct Sheet {
  Sheet() {
    numbers.resize(kColumns * kRows);
    std::iota(numbers.begin(), numbers.end(), 0u);
    std::shuffle(numbers.begin(), numbers.end(), std::mt19937(5));
    positions.resize(numbers.size());
    kinds.resize(numbers.size(), Kind::kPlain);
    for (uint32_t y = 0; y < kRows; ++y) {
      for (uint32_t x = 0; x < kColumns; ++x) {
        positions[at(x, y)] = {static_cast<float>(x), static_cast<float>(y), 0.0f};
      }
    }
    for (uint32_t y = 0; y + 1 < kRows; ++y) {
      for (uint32_t x = 0; x + 1 < kColumns; ++x) {
        triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
        triangles.push_back({at(x + 1, y + 1), at(x, y + 1), at(x, y)});
      }
    }
  }

  uint32_t at(uint32_t x, uint32_t y) const { return numbers[x + kColumns * y]; }

  /// Removes the squares whose lower corners lie in [first, end).
  void cut(const std::array<uint32_t, 2>& first, const std::array<uint32_t, 2>& end) {
    for (uint32_t y = first[1]; y < end[1]; ++y) {
      for (uint32_t x = first[0]; x < end[0]; ++x) {
        const uint32_t corner = at(x, y), opposite = at(x + 1, y + 1);
        const auto isOfSquare = [&](const Triangle& t) {
          return std::count(t.begin(), t.end(), corner) +
                     std::count(t.begin(), t.end(), opposite) ==
                 2;
        };
        triangles.erase(std::remove_if(triangles.begin(), triangles.end(), isOfSquare),
                        triangles.end());
      }
    }
  }

  Outline outline() const {
    Outline outline;
    for (const Kind kind : kinds) outline.addVertex(kind);
    for (const Triangle& triangle : triangles) outline.addTriangle(triangle);
    return outline;
  }

  /// The mesh with its holes closed.
  Mesh closed() const {
    Mesh mesh;
    mesh.vertices_m = positions;
    mesh.normals.resize(positions.size(), {0.0f, 0.0f, 0.0f});
    for (const Triangle& t : triangles) {
      const Vec3f n = cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]);
      for (const uint32_t v : t) mesh.normals[v] = mesh.normals[v] + n;
    }
    mesh.triangles = triangles;
    outline().closeHoles(0, positions.size(), positions, mesh.normals,
                         [&](const Triangle& t) { mesh.triangles.push_back(t); });
    return mesh;
  }

  std::vector<Vec3f> smoothed() const {
    const Outline outline = this->outline();
    std::vector<Vec3f> all;
    for (size_t i = 0; i < positions.size(); ++i) all.push_back(outline.smoothed(i, positions));
    return all;
  }

  std::vector<uint32_t> numbers;
  std::vector<Vec3f> positions;
  std::vector<Kind> kinds;
  std::vector<Triangle> triangles;
};

float distance(const Vec3f& a, const Vec3f& b) { return norm(a - b); }

/// Compares outline vertices with the weighted mean; inner vertices stay.
TEST(Outline, GoesToAWeightedMean) {
  Sheet sheet;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> any(-0.3f, 0.3f);
  for (Vec3f& p : sheet.positions) p = p + Vec3f{any(random), any(random), any(random)};
  const std::vector<Vec3f> smoothed = sheet.smoothed();
  const float weights[5] = {-1, 4, 10, 4, -1};
  for (uint32_t x = 2; x + 2 < kColumns; ++x) {
    Vec3f mean{0, 0, 0};
    for (uint32_t k = 0; k < 5; ++k) {
      mean = mean + weights[k] / 16.0f * sheet.positions[sheet.at(x + k - 2, kRows - 1)];
    }
    EXPECT_LT(distance(smoothed[sheet.at(x, kRows - 1)], mean), 1e-5f);
    EXPECT_EQ(distance(smoothed[sheet.at(x, 1)], sheet.positions[sheet.at(x, 1)]), 0.0f)
        << "inside";
  }
}

/// Smoothing would shorten the end of a strip one square wide.
TEST(Outline, StaysAtTheEndOfSomethingNarrow) {
  Sheet sheet;
  sheet.triangles.resize(2 * (kColumns - 1));
  const std::vector<Vec3f> smoothed = sheet.smoothed();
  for (uint32_t y = 0; y < 2; ++y) {
    EXPECT_EQ(distance(smoothed[sheet.at(0, y)], sheet.positions[sheet.at(0, y)]), 0.0f) << y;
  }
}

TEST(Outline, StaysAtFixedVerticesAndIsNotFollowedPastThem) {
  Sheet sheet;
  for (uint32_t x = 0; x < kColumns; ++x) {
    sheet.positions[sheet.at(x, 0)].y += x % 2 == 0 ? 0.5f : -0.5f;
  }
  sheet.kinds[sheet.at(10, 0)] = Kind::kFixed;
  const std::vector<Vec3f> before = sheet.smoothed();
  sheet.positions[sheet.at(9, 0)].y += 100.0f;
  const std::vector<Vec3f> after = sheet.smoothed();
  EXPECT_EQ(after[sheet.at(10, 0)].y, sheet.positions[sheet.at(10, 0)].y);
  EXPECT_NE(after[sheet.at(8, 0)].y, before[sheet.at(8, 0)].y);
  EXPECT_EQ(after[sheet.at(11, 0)].y, before[sheet.at(11, 0)].y);
}

/// Two sheets that touch in one vertex have outlines that meet there: neither continues into the
/// other.
TEST(Outline, StaysWhereOutlinesMeet) {
  Outline outline;
  const std::vector<Vec3f> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  for (size_t i = 0; i < positions.size(); ++i) outline.addVertex(Kind::kPlain);
  outline.addTriangle({0, 1, 2});
  outline.addTriangle({0, 3, 4});
  for (size_t i = 0; i < positions.size(); ++i) {
    EXPECT_EQ(distance(outline.smoothed(i, positions), positions[i]), 0.0f) << i;
  }
}

/// Midpoints of sides are not steps of their own: a refined outline is smoothed as much as a plain
/// one.
TEST(Outline, TakesTheMiddlesOfSidesAlong) {
  Sheet sheet;
  for (uint32_t x = 0; x < kColumns; ++x) {
    if (x % 2 == 1) sheet.kinds[sheet.at(x, 0)] = Kind::kMiddle;
    const float tooth[4] = {0.5f, 0.0f, -0.5f, 0.0f};
    sheet.positions[sheet.at(x, 0)].y += tooth[x % 4];
  }
  const std::vector<Vec3f> smoothed = sheet.smoothed();
  for (uint32_t x = 4; x + 5 < kColumns; ++x) {
    EXPECT_NEAR(smoothed[sheet.at(x, 0)].y, 0.0f, 1e-6f) << x;
  }
}

TEST(Outline, GoesOnWhereTheFirstVerticesAreForgotten) {
  Sheet sheet;
  sheet.positions[sheet.at(10, 0)].y += 1.0f;
  const std::vector<Vec3f> whole = sheet.smoothed();
  Outline outline;
  for (int i = 0; i < 7; ++i) outline.addVertex(Kind::kPlain);
  for (const Kind kind : sheet.kinds) outline.addVertex(kind);
  for (const Triangle& t : sheet.triangles) outline.addTriangle({t[0] + 7, t[1] + 7, t[2] + 7});
  outline.drop(7);
  for (size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(distance(outline.smoothed(i, sheet.positions), whole[i]), 0.0f);
  }
}

/// Two fans meet at the last vertex. The ends computed from its sums would be the vertices at 0.3
/// and 0.4 of the way, which are not its neighbours.
TEST(Outline, StaysWhereTwoFansSeemToLeadToForgottenVertices) {
  Outline outline;
  constexpr uint32_t kTenth = 100000;
  std::vector<Vec3f> positions(10 * kTenth + 1, {1.0f, 2.0f, 3.0f});
  for (size_t i = 0; i < positions.size(); ++i) outline.addVertex(Kind::kPlain);
  outline.addTriangle({10 * kTenth, 5 * kTenth, 7 * kTenth});
  outline.addTriangle({10 * kTenth, 9 * kTenth, 8 * kTenth});
  EXPECT_EQ(outline.smoothed(10 * kTenth, positions).x, 1.0f);
  outline.drop(5 * kTenth);
  EXPECT_EQ(outline.smoothed(5 * kTenth, positions).x, 1.0f);
}

constexpr size_t kRim = 2 * (kColumns - 1 + kRows - 1);

TEST(Outline, ClosesHolesOfUpToEightEdges) {
  Sheet sheet;
  sheet.triangles.erase(sheet.triangles.begin() + 2 * 25);  // 3 edges
  sheet.cut({8, 1}, {9, 2});                                // 4
  sheet.cut({12, 1}, {15, 2});                              // 8
  sheet.positions[sheet.at(12, 1)].z = 0.5f;
  const MeshTopology closed = measureTopology(sheet.closed());
  EXPECT_EQ(closed.boundary_edges, kRim) << closed;
  EXPECT_EQ(closed.nonmanifold_edges + closed.inconsistent_edges, 0u) << closed;
  sheet.cut({1, 2}, {5, 3});  // 10
  EXPECT_EQ(measureTopology(sheet.closed()).boundary_edges, kRim + 10);
}

TEST(Outline, ClosesHolesAtAnEdge) {
  Sheet sheet;
  for (uint32_t y = 0; y < kRows; ++y) {
    for (uint32_t x = 10; x < kColumns; ++x) {
      sheet.positions[sheet.at(x, y)] = {10.0f, static_cast<float>(y),
                                         10.0f - static_cast<float>(x)};
    }
  }
  sheet.cut({9, 1}, {11, 2});
  EXPECT_EQ(measureTopology(sheet.closed()).boundary_edges, kRim);
}

TEST(Outline, MiddlesAreNoEdgesOfAHole) {
  Sheet sheet;
  sheet.cut({4, 1}, {10, 3});
  EXPECT_EQ(measureTopology(sheet.closed()).boundary_edges, kRim + 16);
  for (const uint32_t y : {1u, 3u}) {
    for (const uint32_t x : {5u, 7u, 9u}) sheet.kinds[sheet.at(x, y)] = Kind::kMiddle;
  }
  for (const uint32_t x : {4u, 10u}) sheet.kinds[sheet.at(x, 2)] = Kind::kMiddle;
  EXPECT_EQ(measureTopology(sheet.closed()).boundary_edges, kRim);
}

/// A piece of a few triangles has an outline as short as that of a hole.
TEST(Outline, ClosesNoSmallPieces) {
  for (const size_t count : {1u, 2u, 4u, 6u}) {
    Sheet sheet;
    sheet.triangles.resize(count);
    sheet.positions[sheet.at(1, 1)].z = 0.7f;
    EXPECT_EQ(sheet.closed().triangles.size(), count);
  }
}

TEST(Outline, ClosesNoHoleWhereTrianglesMayBeElsewhere) {
  Sheet sheet;
  sheet.cut({8, 1}, {9, 2});
  sheet.kinds[sheet.at(9, 1)] = Kind::kFixed;
  EXPECT_EQ(measureTopology(sheet.closed()).boundary_edges, kRim + 4);
}

}  // namespace
}  // namespace dtsdf
