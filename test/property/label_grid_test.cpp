// Random labels on the corners of a grid, meshed unit by unit with the tables: whatever the labels,
// the surface has no boundary inside the grid and separates front from behind.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "kernels/meshing/mesh_tables.h"
#include "support/mesh_topology.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

constexpr int kSide = 10;  // corners; those on the outside are in front, so the surface is closed

struct Labels {
  std::vector<bool> behind = std::vector<bool>(kSide * kSide * kSide, false);

  size_t indexOf(int x, int y, int z) const {
    return static_cast<size_t>(x + kSide * (y + kSide * z));
  }
};

Labels randomLabels(std::mt19937& random, double share_behind) {
  Labels labels;
  std::bernoulli_distribution behind(share_behind);
  for (int z = 1; z < kSide - 1; ++z) {
    for (int y = 1; y < kSide - 1; ++y) {
      for (int x = 1; x < kSide - 1; ++x) labels.behind[labels.indexOf(x, y, z)] = behind(random);
    }
  }
  return labels;
}

/// A vertex for each crossed edge of the grid: its number is 3 * lower corner + axis.
std::vector<Triangle> meshLabels(const Labels& labels) {
  std::vector<Triangle> triangles;
  for (int z = 0; z + 1 < kSide; ++z) {
    for (int y = 0; y + 1 < kSide; ++y) {
      for (int x = 0; x + 1 < kSide; ++x) {
        const auto corner = [&](int c) {
          return labels.indexOf(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1));
        };
        int index = 0;
        for (int c = 0; c < 8; ++c) index |= (labels.behind[corner(c)] ? 1 : 0) << c;
        const auto vertex = [&](int e) {
          return static_cast<uint32_t>(3 * corner(kEdgeLowerCorner[e]) +
                                       static_cast<size_t>(e / 4));
        };
        const uint8_t* edges = kMeshTables.triangle_edge[index];
        for (int t = 0; t < kMeshTables.triangle_count[index]; ++t) {
          triangles.push_back(
              {vertex(edges[3 * t]), vertex(edges[3 * t + 1]), vertex(edges[3 * t + 2])});
        }
      }
    }
  }
  return triangles;
}

/// Six times the volume that the surface encloses, in sixths of a voxel at vertices in the middle
/// of the edges: positive if it is seen from the front.
double enclosedVolume(const std::vector<Triangle>& triangles) {
  const auto position = [](uint32_t vertex) {
    const int corner = static_cast<int>(vertex / 3), axis = static_cast<int>(vertex % 3);
    Eigen::Vector3d p(corner % kSide, corner / kSide % kSide, corner / (kSide * kSide));
    p[axis] += 0.5;
    return p;
  };
  double volume = 0.0;
  for (const Triangle& t : triangles) {
    volume += position(t[0]).dot(position(t[1]).cross(position(t[2])));
  }
  return volume / 6.0;
}

TEST(LabelGrid, SurfacesAreClosedAndConsistent) {
  for (int n = 0; n < 60; ++n) {
    const uint32_t seed = caseSeed(n);
    SCOPED_TRACE(describeSeed(seed));
    std::mt19937 random(seed);
    const double share = 0.05 + 0.9 * (random() % 1000) / 1000.0;
    const MeshTopology topology = measureTopology(meshLabels(randomLabels(random, share)));
    ASSERT_GT(topology.triangles, 0u);
    EXPECT_EQ(topology.boundary_edges, 0u) << topology;
    EXPECT_EQ(topology.crowded_edges, 0u) << topology;
    EXPECT_EQ(topology.inconsistent_edges, 0u) << topology;
  }
}

/// A single corner behind is an octahedron of 1/6 voxel; corners that do not touch add up.
TEST(LabelGrid, LoneCornersEncloseASixthOfAVoxelEach) {
  Labels labels;
  int count = 0;
  for (int z = 1; z < kSide - 1; z += 2) {
    for (int y = 1; y < kSide - 1; y += 2) {
      for (int x = 1; x < kSide - 1; x += 2, ++count) labels.behind[labels.indexOf(x, y, z)] = true;
    }
  }
  EXPECT_NEAR(enclosedVolume(meshLabels(labels)), count / 6.0, 1e-9);
}

TEST(LabelGrid, EveryCornerBehindAddsVolume) {
  for (int n = 0; n < 20; ++n) {
    const uint32_t seed = caseSeed(n);
    SCOPED_TRACE(describeSeed(seed));
    std::mt19937 random(seed);
    Labels labels = randomLabels(random, 0.3);
    const double before = enclosedVolume(meshLabels(labels));
    const auto inside = [&] { return 1 + static_cast<int>(random() % (kSide - 2)); };
    size_t corner;
    do {
      corner = labels.indexOf(inside(), inside(), inside());
    } while (labels.behind[corner]);
    labels.behind[corner] = true;
    EXPECT_GT(enclosedVolume(meshLabels(labels)), before);
  }
}

}  // namespace
}  // namespace dtsdf
