// Tests cropping a mesh to a box.
#include <gtest/gtest.h>

#include "dtsdf_mapping/mesh.h"
#include "kernels/meshing/edge_vertex.h"
#include "support/grid_mesh.h"
#include "support/mesh_topology.h"

namespace dtsdf {
namespace {

constexpr float kVoxel_m = 0.05f;

/// A block of a surface that is wavy along x, with free space above.
BlockMesh slopeBlock(const BlockKey& key, float height) {
  BlockMesh mesh;
  mesh.key = key;
  for (int y = 0; y < kCornerGridSide; ++y) {
    for (int x = 0; x < kCornerGridSide; ++x) {
      const int edge = edgeNumber(cornerIndex(x, y, 3), 2, 0);
      const float at = height + 0.03f * static_cast<float>((8 * key.x + x) % 5);
      mesh.vertices.push_back({vertexPosition(edge, at), static_cast<uint32_t>(edge)});
      const auto red = static_cast<uint8_t>(8 * key.x + x);
      mesh.colours.push_back({red, static_cast<uint8_t>(y), 7, 255});
    }
  }
  mesh.triangles = gridTriangles(kCornerGridSide);
  return mesh;
}

bool isSame(const Vec3f& a, const Vec3f& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// Cropping returns the same triangles, in the same order, as filtering the whole mesh, even at
/// block borders.
TEST(CroppedMesh, HasExactlyTheTrianglesInside) {
  MeshStore store(kVoxel_m);
  MeshUpdate update;
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) update.blocks.push_back(slopeBlock({x, y, 0}, 0.3f));
  }
  store.apply(update);
  const Mesh whole = store.assemble();
  for (const double turn : {0.0, 0.5}) {
    BoxRegion box;
    box.T_W_B =
        Eigen::Translation3d(0.81, 0.77, 0.16) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
    box.size_m = {0.85, 0.6, 0.5};
    const auto inside = [&](uint32_t v) {
      const Vec3f& p = whole.vertices_m[v];
      const Eigen::Vector3d p_B = box.T_W_B.inverse() * Eigen::Vector3d(p.x, p.y, p.z);
      return (p_B.cwiseAbs().array() <= 0.5 * box.size_m.array()).all();
    };
    const Mesh part = store.assemble(box);
    size_t next = 0;
    for (const auto& t : whole.triangles) {
      if (!inside(t[0]) || !inside(t[1]) || !inside(t[2])) continue;
      ASSERT_LT(next, part.triangles.size());
      for (int k = 0; k < 3; ++k) {
        const uint32_t of_whole = t[k], of_part = part.triangles[next][k];
        ASSERT_TRUE(isSame(part.vertices_m[of_part], whole.vertices_m[of_whole]));
        ASSERT_TRUE(isSame(part.normals[of_part], whole.normals[of_whole]));
        ASSERT_EQ(part.colours[of_part].red, whole.colours[of_whole].red);
      }
      ++next;
    }
    EXPECT_EQ(next, part.triangles.size());
    EXPECT_GT(next, 100u);
    const MeshTopology topology = measureTopology(part);
    EXPECT_EQ(topology.unused_vertices + topology.nonmanifold_edges, 0u) << topology;
  }
}

TEST(CroppedMesh, IsEmptyOutsideTheMesh) {
  MeshStore store(kVoxel_m);
  MeshUpdate update;
  update.blocks.push_back(slopeBlock({0, 0, 0}, 0.3f));
  store.apply(update);
  BoxRegion box;
  box.T_W_B.translation() = Eigen::Vector3d(10.0, 0.0, 0.0);
  box.size_m = {1.0, 1.0, 1.0};
  const Mesh part = store.assemble(box);
  EXPECT_TRUE(part.triangles.empty());
  EXPECT_TRUE(part.vertices_m.empty());
  box.size_m = {100.0, 100.0, 100.0};
  EXPECT_EQ(store.assemble(box).triangles.size(), store.assemble().triangles.size());
}

}  // namespace
}  // namespace dtsdf
