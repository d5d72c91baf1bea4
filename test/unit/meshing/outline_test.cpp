// Tests how outlines are smoothed, which holes and gaps are closed, and which crumbs (small loose
// pieces) are removed.
#include "meshing/mend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <tuple>

#include "dtsdf_mapping/mesh.h"
#include "kernels/core/vec.h"
#include "support/mesh_topology.h"

namespace dtsdf {
namespace {

using Kind = Outline::Kind;
using Triangle = std::array<uint32_t, 3>;

constexpr uint32_t kColumns = 20, kRows = 5, kVertices = kColumns * kRows;

/// A sheet of squares, each split into two triangles. Vertices are in random order, which must not
/// affect the results.
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
    outline.link(0, kVertices, triangles);
    return outline;
  }

  Mesh mesh() const {
    Mesh mesh;
    mesh.vertices_m = positions;
    mesh.triangles = triangles;
    mesh.normals.resize(positions.size(), {0.0f, 0.0f, 0.0f});
    for (const Triangle& t : triangles) {
      const Vec3f n = cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]);
      for (const uint32_t v : t) mesh.normals[v] = mesh.normals[v] + n;
    }
    return mesh;
  }

  /// The mesh without crumbs, with holes and gaps closed, not smoothed.
  Mesh mended() const {
    Mesh mesh = this->mesh();
    Outline outline = this->outline();
    removeCrumbs(outline, 0, kVertices, positions, 1.0f);
    mesh.triangles.clear();
    for (const Triangle& t : triangles) {
      if (!isCrumb(outline, t)) mesh.triangles.push_back(t);
    }
    closeHolesAndGaps(outline, 0, kVertices, positions, mesh.normals, 1.0f,
                      [&](const Triangle& t) { mesh.triangles.push_back(t); });
    return mesh;
  }

  std::vector<Vec3f> smoothed() const {
    const Outline outline = this->outline();
    std::vector<Vec3f> all;
    for (uint32_t i = 0; i < kVertices; ++i) all.push_back(dtsdf::smoothed(outline, i, positions));
    return all;
  }

  std::vector<uint32_t> numbers;
  std::vector<Vec3f> positions;
  std::vector<Kind> kinds;
  std::vector<Triangle> triangles;
};

float distance(const Vec3f& a, const Vec3f& b) { return norm(a - b); }

/// Outline vertices move to a weighted mean; inner vertices stay.
TEST(Outline, MovesToAWeightedMean) {
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
    EXPECT_EQ(distance(smoothed[sheet.at(x, 1)], sheet.positions[sheet.at(x, 1)]), 0.0f);
  }
}

/// Smoothing would shorten a strip one square wide, so its end stays in place.
TEST(Outline, StaysAtTheEndOfANarrowStrip) {
  Sheet sheet;
  sheet.triangles.resize(2 * (kColumns - 1));
  const std::vector<Vec3f> smoothed = sheet.smoothed();
  for (uint32_t y = 0; y < 2; ++y) {
    EXPECT_EQ(distance(smoothed[sheet.at(0, y)], sheet.positions[sheet.at(0, y)]), 0.0f) << y;
  }
}

TEST(Outline, StopsAtFixedVertices) {
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

/// The outlines of two sheets touch at a vertex. Neither outline continues into the other.
TEST(Outline, StaysWhereOutlinesMeet) {
  Outline outline;
  const std::vector<Vec3f> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 3, 4}};
  for (size_t i = 0; i < positions.size(); ++i) outline.addVertex(Kind::kPlain);
  for (const Triangle& t : triangles) outline.addTriangle(t);
  outline.link(0, 5, triangles);
  EXPECT_EQ(distance(smoothed(outline, 0, positions), positions[0]), 0.0f);
}

/// Midpoints of sides do not count as neighbours, so a refined outline is smoothed as much as a
/// plain outline.
TEST(Outline, MidpointsAreNotSteps) {
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

constexpr size_t kRim = 2 * (kColumns - 1 + kRows - 1);

TEST(Outline, ClosesHolesOfUpToEightEdges) {
  Sheet sheet;
  sheet.triangles.erase(sheet.triangles.begin() + 2 * 25);  // 3 edges
  sheet.cut({8, 1}, {9, 2});                                // 4
  sheet.cut({12, 1}, {15, 2});                              // 8
  sheet.positions[sheet.at(12, 1)].z = 0.5f;
  const MeshTopology closed = measureTopology(sheet.mended());
  EXPECT_EQ(closed.boundary_edges, kRim) << closed;
  EXPECT_EQ(closed.nonmanifold_edges + closed.inconsistent_edges, 0u) << closed;
  sheet.cut({1, 1}, {4, 3});  // 10, of which the ball takes two at each corner
  EXPECT_EQ(measureTopology(sheet.mended()).boundary_edges, kRim + 10 - 4);
}

TEST(Outline, ClosesHolesAtABend) {
  Sheet sheet;
  for (uint32_t y = 0; y < kRows; ++y) {
    for (uint32_t x = 10; x < kColumns; ++x) {
      sheet.positions[sheet.at(x, y)] = {10.0f, static_cast<float>(y),
                                         10.0f - static_cast<float>(x)};
    }
  }
  sheet.cut({9, 1}, {11, 2});
  const MeshTopology mended = measureTopology(sheet.mended());
  EXPECT_EQ(mended.boundary_edges, kRim - 2);  // the ball also rests at both ends of the bend
  EXPECT_EQ(mended.nonmanifold_edges + mended.inconsistent_edges, 0u) << mended;
}

TEST(Outline, MidpointsDoNotSplitEdgesOfAHole) {
  Sheet sheet;
  sheet.cut({4, 1}, {10, 3});
  EXPECT_EQ(measureTopology(sheet.mended()).boundary_edges, kRim + 16 - 4);  // see above
  for (const uint32_t y : {1u, 3u}) {
    for (const uint32_t x : {5u, 7u, 9u}) sheet.kinds[sheet.at(x, y)] = Kind::kMiddle;
  }
  for (const uint32_t x : {4u, 10u}) sheet.kinds[sheet.at(x, 2)] = Kind::kMiddle;
  EXPECT_EQ(measureTopology(sheet.mended()).boundary_edges, kRim);
}

/// A loose strip of 16 triangles is removed if it is within four voxels of a sheet. A strip of 18
/// triangles is kept.
TEST(Outline, LeavesOutSmallPiecesNearLargerOnes) {
  for (const auto& [columns, distance, kind, stay] : {std::tuple{8u, 3.0f, Kind::kPlain, false},
                                                      {8u, 4.5f, Kind::kPlain, true},
                                                      {9u, 3.0f, Kind::kPlain, true},
                                                      {9u, 3.0f, Kind::kMiddle, false}}) {
    Sheet sheet;
    sheet.kinds[sheet.at(1, 0)] = kind;  // a refined piece may have 64 triangles
    sheet.cut({0, 1}, {columns, 4});
    sheet.cut({columns, 0}, {columns + 1, 4});
    for (const uint32_t y : {0u, 1u}) {
      for (uint32_t x = 0; x <= columns; ++x) sheet.positions[sheet.at(x, y)].z = distance;
    }
    const size_t sheet_triangles = 2 * 4 * (kColumns - 2 - columns);
    EXPECT_EQ(sheet.mended().triangles.size(), sheet_triangles + (stay ? 2 * columns : 0))
        << columns << " " << distance;
  }
}

/// A piece of two triangles touches the sheet at one vertex.
TEST(Outline, KeepsSmallPiecesThatTouchLargerOnes) {
  Sheet sheet;
  sheet.cut({17, 0}, {18, 4});
  sheet.cut({18, 0}, {19, 3});
  sheet.triangles.push_back({sheet.at(17, 4), sheet.at(18, 4), sheet.at(18, 3)});
  sheet.triangles.erase(sheet.triangles.end() - 2);
  const Mesh mended = sheet.mended();  // with four new triangles beside that vertex
  EXPECT_EQ(mended.triangles.size(), 2 * 17 * 4u + 2u + 4u);
  const MeshTopology topology = measureTopology(mended);
  EXPECT_EQ(topology.nonmanifold_edges + topology.inconsistent_edges, 0u) << topology;
}

/// One crack cuts the sheet in two, with or without a step in height. Another lies inside the
/// sheet.
TEST(Outline, BridgesCracksOfAVoxel) {
  for (const float step : {0.0f, 0.5f, -0.5f}) {
    Sheet sheet;
    sheet.cut({10, 0}, {11, 4});
    for (uint32_t y = 0; y < kRows; ++y) {
      for (uint32_t x = 11; x < kColumns; ++x) sheet.positions[sheet.at(x, y)].z += step;
    }
    sheet.cut({1, 1}, {8, 2});
    const MeshTopology mended = measureTopology(sheet.mended());
    EXPECT_EQ(mended.boundary_edges, kRim) << step;
    EXPECT_EQ(mended.nonmanifold_edges + mended.inconsistent_edges, 0u) << mended;
  }
}

TEST(Outline, KeepsGapsOfTwoVoxels) {
  Sheet sheet;
  sheet.cut({9, 0}, {11, 4});
  EXPECT_EQ(measureTopology(sheet.mended()).boundary_edges, kRim + 2 * 4 - 2 * 2);
}

/// The two sides of a plate face away from each other. The ball closes its rim if it is thin.
TEST(Outline, ClosesTheRimOfAThinPlate) {
  for (const float thickness : {0.8f, 2.0f}) {
    Sheet sheet;
    sheet.cut({10, 0}, {11, 4});
    for (uint32_t y = 0; y < kRows; ++y) {
      for (uint32_t x = 11; x < kColumns; ++x) {
        sheet.positions[sheet.at(x, y)] = {21.0f - static_cast<float>(x), static_cast<float>(y),
                                           -thickness};
      }
    }
    const MeshTopology mended = measureTopology(sheet.mended());
    EXPECT_EQ(mended.nonmanifold_edges + mended.inconsistent_edges, 0u) << mended;
    if (thickness > 1.0f) {
      EXPECT_EQ(mended.boundary_edges, kRim + 2 * 4 - 2);
    } else {
      EXPECT_LT(mended.boundary_edges, kRim + 2);
    }
  }
}

/// Filling the notches between teeth makes an outline shorter, but not the surface larger.
TEST(Outline, FillsNotchesAndKeepsTheArea) {
  Sheet sheet;
  for (uint32_t x = 3; x < kColumns - 4; x += 2) {
    const Triangle notch{sheet.at(x, 0), sheet.at(x + 1, 0), sheet.at(x + 1, 1)};
    sheet.triangles.erase(std::find(sheet.triangles.begin(), sheet.triangles.end(), notch));
  }
  const auto area = [](const Mesh& mesh) {
    float sum = 0.0f;
    for (const Triangle& t : mesh.triangles) {
      const Vec3f& p = mesh.vertices_m[t[0]];
      sum += 0.5f * norm(cross(mesh.vertices_m[t[1]] - p, mesh.vertices_m[t[2]] - p));
    }
    return sum;
  };
  const auto cells = static_cast<float>(sheet.triangles.size()) / 2.0f;
  Mesh mended = sheet.mesh();
  Outline outline = sheet.outline();
  mendMesh(mended, outline, 1.0f);
  EXPECT_NEAR(area(mended), cells, 0.02f * cells);
  const MeshTopology topology = measureTopology(mended);
  EXPECT_LE(topology.boundary_edges, kRim);
  EXPECT_EQ(topology.nonmanifold_edges + topology.inconsistent_edges, 0u) << topology;
}

/// The triangle at the fixed vertex stays open.
TEST(Outline, KeepsHolesAtFixedVertices) {
  Sheet sheet;
  sheet.cut({8, 1}, {9, 2});
  sheet.kinds[sheet.at(9, 1)] = Kind::kFixed;
  EXPECT_EQ(measureTopology(sheet.mended()).boundary_edges, kRim + 3);
}

}  // namespace
}  // namespace dtsdf
