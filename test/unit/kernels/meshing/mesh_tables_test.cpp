// The derived tables against properties that define a correct surface in a cube; the cube is
// described a second time, in cube_geometry.h.
#include "kernels/meshing/mesh_tables.h"

#include <gtest/gtest.h>

#include <map>

#include "unit/kernels/meshing/cube_geometry.h"

namespace dtsdf {
namespace mesh_tables_test {

std::set<std::array<int, 3>> triangleSet(int index) {
  std::set<std::array<int, 3>> result;
  for (std::array<int, 3> t : trianglesOf(index)) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    result.insert(t);
  }
  return result;
}

TEST(MeshTables, EdgesAreNumberedByAxisAndLowerCorner) {
  const auto edges = cubeEdges();
  for (int e = 0; e < kCubeEdges; ++e) {
    EXPECT_EQ(kEdgeLowerCorner[e], edges[static_cast<size_t>(e)].first);
    EXPECT_EQ(edgeLowerCorner(e), edges[static_cast<size_t>(e)].first);
    EXPECT_EQ(edgeLowerCorner(e) | 1 << (e / 4), edges[static_cast<size_t>(e)].second);
  }
}

TEST(MeshTables, UniformCornersHaveNoSurface) {
  for (const int index : {0, 255}) {
    EXPECT_EQ(kMeshTables.triangle_count[index], 0);
    EXPECT_EQ(kMeshTables.component_count[index], 0);
  }
}

TEST(MeshTables, TrianglesUseExactlyTheCrossedEdges) {
  for (int index = 0; index < 256; ++index) {
    std::set<int> used;
    for (const auto& t : trianglesOf(index)) {
      used.insert(t.begin(), t.end());
      EXPECT_EQ(std::set<int>(t.begin(), t.end()).size(), 3u) << "index " << index;
    }
    EXPECT_EQ(used, crossedEdges(index)) << "index " << index;
  }
}

TEST(MeshTables, EveryLoopIsClosedAndLiesOnTheFacesOfTheCube) {
  for (int index = 0; index < 256; ++index) {
    std::map<int, int> arrivals, departures;
    for (const Segment& segment : rimOf(index)) {
      ++departures[segment.first];
      ++arrivals[segment.second];
      EXPECT_EQ(facesOf(segment).size(), 1u) << "index " << index;
    }
    for (const int e : crossedEdges(index)) {
      EXPECT_EQ(arrivals[e], 1) << "index " << index << ", edge " << e;
      EXPECT_EQ(departures[e], 1) << "index " << index << ", edge " << e;
    }
  }
}

/// A side inside the cube that ran on a face could coincide with a side of the unit across it.
TEST(MeshTables, DiagonalsKeepOffTheFaces) {
  for (int index = 0; index < 256; ++index) {
    const std::set<Segment> rim = rimOf(index);
    for (const auto& t : trianglesOf(index)) {
      for (size_t i = 0; i < 3; ++i) {
        const Segment side{t[i], t[(i + 1) % 3]};
        EXPECT_EQ(facesOf(side).empty(), rim.count(side) == 0) << "index " << index;
      }
    }
  }
}

/// Seen from the front, a counter-clockwise surface has its inside on the left of its rim.
TEST(MeshTables, RimsRunCounterClockwiseSeenFromTheFront) {
  for (int index = 0; index < 256; ++index) {
    for (const Segment& segment : rimOf(index)) {
      const Eigen::Vector3d start = edgeMiddle(segment.first);
      const Eigen::Vector3d along = edgeMiddle(segment.second) - start;
      const Eigen::Vector3d towards_front = facesOf(segment).at(0).cross(along);
      const auto [a, b] = cubeEdges()[static_cast<size_t>(segment.first)];
      const Eigen::Vector3d front = cornerPoint(isBehind(index, a) ? b : a);
      EXPECT_GT(towards_front.dot(front - start), 0.0) << "index " << index;
    }
  }
}

/// Two units that share a face pass each segment on it in opposite ways, for all labels of their
/// twelve corners: surfaces of neighbouring units join without gap or overlap.
TEST(MeshTables, NeighboursAgreeOnTheirSharedFace) {
  for (int axis = 0; axis < 3; ++axis) {
    const int bit = 1 << axis;
    const auto segmentsOn = [&](int index, double side, bool reversed) {
      std::set<std::pair<int, int>> segments;  // by the edges' numbers on the low side
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
          << "indices " << left << " and " << right << " across axis " << axis;
    }
  }
}

TEST(MeshTables, ComplementTurnsTheSurfaceRound) {
  for (int index = 0; index < 256; ++index) {
    const int complement = 255 - index;
    EXPECT_EQ(crossedEdges(index), crossedEdges(complement));
    if (hasAmbiguousFace(index)) continue;  // there the behind corners are cut off, on purpose
    std::set<Segment> reversed;
    for (const auto& [from, to] : rimOf(complement)) reversed.insert({to, from});
    EXPECT_EQ(rimOf(index), reversed) << "index " << index;
    EXPECT_EQ(kMeshTables.component_count[index], kMeshTables.component_count[complement]);
  }
}

TEST(MeshTables, ComponentsAreSingle) {
  for (int index = 0; index < 256; ++index) {
    for (int i = 0; i < kMeshTables.component_count[index]; ++i) {
      const uint8_t component = kMeshTables.component[index][i];
      ASSERT_EQ(kMeshTables.component_count[component], 1) << "index " << index;
      EXPECT_EQ(kMeshTables.component[component][0], component) << "index " << index;
    }
  }
}

TEST(MeshTables, ComponentsMakeUpTheIndex) {
  for (int index = 0; index < 256; ++index) {
    std::set<std::array<int, 3>> triangles;
    size_t count = 0;
    for (int i = 0; i < kMeshTables.component_count[index]; ++i) {
      const auto part = triangleSet(kMeshTables.component[index][i]);
      triangles.insert(part.begin(), part.end());
      count += part.size();
    }
    EXPECT_EQ(triangles, triangleSet(index)) << "index " << index;
    EXPECT_EQ(count, triangles.size()) << "components of index " << index << " overlap";
  }
}

TEST(MeshTables, RemovingAComponentLeavesTheOthers) {
  for (int index = 0; index < 256; ++index) {
    for (int i = 0; i < kMeshTables.component_count[index]; ++i) {
      const uint8_t component = kMeshTables.component[index][i];
      std::set<std::array<int, 3>> rest = triangleSet(index);
      for (const auto& t : triangleSet(component)) rest.erase(t);
      const uint8_t left = removeComponent(static_cast<uint8_t>(index), component);
      EXPECT_EQ(triangleSet(left), rest) << "index " << index << " without " << int(component);
    }
  }
}

/// Per direction an index is impossible if one of four parallel edges is crossed the wrong way, so
/// 3^4 of 4^4 are not; of these, 2^4 cross none of them, two of which have no surface at all.
TEST(MeshTables, VerdictCounts) {
  std::map<Verdict, int> counts;
  for (int index = 1; index < 255; ++index) {
    for (int d = 0; d < 6; ++d) ++counts[judgeComponent(static_cast<uint8_t>(index), d)];
  }
  EXPECT_EQ(counts[Verdict::kReject], 6 * (4 * 4 * 4 * 4 - 3 * 3 * 3 * 3));
  EXPECT_EQ(counts[Verdict::kAccept], 6 * (3 * 3 * 3 * 3 - 2 * 2 * 2 * 2));
  EXPECT_EQ(counts[Verdict::kAskGradient], 6 * (2 * 2 * 2 * 2 - 2));
  EXPECT_EQ(counts[Verdict::kReject], 1050);
  EXPECT_EQ(counts[Verdict::kAccept], 390);
  EXPECT_EQ(counts[Verdict::kAskGradient], 84);
}

/// A direction sees a surface from its +D side: walking along D from behind to in front.
TEST(MeshTables, VerdictsFollowTheEdgesAlongTheDirection) {
  for (int index = 1; index < 255; ++index) {
    for (int d = 0; d < 6; ++d) {
      bool right = false, wrong = false;
      for (const auto& [lower, upper] : cubeEdges()) {
        if (upper - lower != 1 << (d / 2)) continue;
        const int start = d % 2 == 0 ? lower : upper, end = d % 2 == 0 ? upper : lower;
        right |= isBehind(index, start) && !isBehind(index, end);
        wrong |= !isBehind(index, start) && isBehind(index, end);
      }
      const Verdict expected =
          wrong ? Verdict::kReject : (right ? Verdict::kAccept : Verdict::kAskGradient);
      EXPECT_EQ(judgeComponent(static_cast<uint8_t>(index), d), expected)
          << "index " << index << ", direction " << d;
    }
  }
}

}  // namespace mesh_tables_test
}  // namespace dtsdf
