// Tests that in each marching-cubes case, the triangles form a consistent surface in the cube.
#include "kernels/meshing/mesh_tables.h"

#include <gtest/gtest.h>

#include <map>

#include "unit/kernels/meshing/cube_geometry.h"

namespace dtsdf {
namespace mesh_tables_test {

TEST(MeshTables, TrianglesUseExactlyTheCrossedEdges) {
  for (int index = 0; index < 256; ++index) {
    std::set<int> used;
    for (const auto& t : trianglesOf(index)) {
      used.insert(t.begin(), t.end());
      EXPECT_EQ(std::set<int>(t.begin(), t.end()).size(), 3u) << "case " << index;
    }
    EXPECT_EQ(used, crossedEdges(index)) << "case " << index;
  }
}

TEST(MeshTables, EveryLoopIsClosedAndLiesOnTheFacesOfTheCube) {
  for (int index = 0; index < 256; ++index) {
    std::map<int, int> arrivals, departures;
    for (const Segment& segment : rimOf(index)) {
      ++departures[segment.first];
      ++arrivals[segment.second];
      EXPECT_EQ(facesOf(segment).size(), 1u) << "case " << index;
    }
    for (const int e : crossedEdges(index)) {
      EXPECT_EQ(arrivals[e], 1) << "case " << index << ", edge " << e;
      EXPECT_EQ(departures[e], 1) << "case " << index << ", edge " << e;
    }
  }
}

/// Triangles run counter-clockwise when viewed from the front, so the surface must lie to the left
/// of its rim.
TEST(MeshTables, RimsRunCounterClockwiseSeenFromTheFront) {
  for (int index = 0; index < 256; ++index) {
    for (const Segment& segment : rimOf(index)) {
      const Eigen::Vector3d start = edgeMiddle(segment.first);
      const Eigen::Vector3d along = edgeMiddle(segment.second) - start;
      const Eigen::Vector3d towards_front = facesOf(segment).at(0).cross(along);
      const auto [a, b] = cubeEdges()[static_cast<size_t>(segment.first)];
      const Eigen::Vector3d front = cornerPoint(isBehind(index, a) ? b : a);
      EXPECT_GT(towards_front.dot(front - start), 0.0) << "case " << index;
    }
  }
}

/// For every labelling of their twelve corners, two neighbouring cubes traverse each segment on
/// their common face in opposite directions. So their surfaces join without gaps or overlaps.
TEST(MeshTables, NeighboursAgreeOnTheirSharedFace) {
  for (int axis = 0; axis < 3; ++axis) {
    const int bit = 1 << axis;
    const auto segmentsOn = [&](int index, double side, bool reversed) {
      std::set<std::pair<int, int>> segments;  // pairs of edge indices on the lower face
      for (const auto& [from, to] : rimOf(index)) {
        const Eigen::Vector3d normal = facesOf({from, to}).at(0);
        if (normal[axis] != side) continue;
        const auto lowered = [&](int e) {
          const auto [a, b] = cubeEdges()[static_cast<size_t>(e)];
          return (a & ~bit) * 8 + (b & ~bit);
        };
        segments.insert(reversed ? std::make_pair(lowered(to), lowered(from))
                                 : std::make_pair(lowered(from), lowered(to)));
      }
      return segments;
    };
    for (int labels = 0; labels < 1 << 12; ++labels) {
      int left = labels & 255, right = 0, free_bits = labels >> 8;
      for (int c = 0; c < 8; ++c) {
        const bool behind = (c & bit) ? free_bits & 1 : isBehind(left, c | bit);
        if (c & bit) free_bits >>= 1;
        right |= (behind ? 1 : 0) << c;
      }
      ASSERT_EQ(segmentsOn(left, 1.0, false), segmentsOn(right, -1.0, true))
          << "cases " << left << " and " << right << " across axis " << axis;
    }
  }
}

}  // namespace mesh_tables_test
}  // namespace dtsdf
