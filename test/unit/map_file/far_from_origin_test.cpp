// Tests that a wall up to 100 km from the map's origin has meshes and published chunks as good as
// those of a wall near the origin.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "kernels/core/vec.h"
#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "support/depth_frames.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// A metre is a whole number of voxels, so shifting a wall by metres does not move it relative to
/// the grid.
constexpr float kVoxel_m = 1.0f / 64.0f;
/// Maximum additional error of the wall far from the origin.
constexpr double kMaxError_m = 1e-4;
constexpr double kMapError_m = 1e-3;
/// The maximum number of additional triangles that are so thin, far from the origin, that their
/// area is 0 in floats.
constexpr size_t kMaxThinTriangles = 5;

/// A tilted wall in front of a camera; both are shifted.
struct Wall {
  explicit Wall(const Vector3d& shift_W)
      : shift_W(shift_W),
        normal_W(Vector3d(-1.0, 0.2, 0.1).normalized()),
        point_W(shift_W + Vector3d(1.5, 0.0, 0.0)) {}

  double distance(const Vector3d& p_W) const { return normal_W.dot(p_W - point_W); }

  MeshStore map() const {
    Scene scene;
    scene.add(Plane{point_W, normal_W});
    const auto mapper = makeMapper(makeCpuParams(FusionMode::kNormalRayCasting, true, kVoxel_m));
    for (const double y : {-0.1, 0.0, 0.1}) {
      const Vector3d eye_W = shift_W + Vector3d(0.0, y, 0.05);
      const Eigen::Isometry3d T_W_C = lookAt(eye_W, eye_W + Vector3d::UnitX(), Vector3d::UnitZ());
      EXPECT_EQ(mapper->integrate(renderFrame(scene, T_W_C).view()).status, FrameStatus::kFused);
    }
    MeshStore store(kVoxel_m);
    store.apply(mapper->updateMesh());
    return store;
  }

  Vector3d shift_W, normal_W, point_W;
};

/// A mesh as a subscriber receives it, in double precision.
struct ReadMesh {
  std::vector<Vector3d> positions, normals;
  std::vector<std::array<uint32_t, 3>> triangles;
};

/// Assembles the mesh from the chunks of the topic mesh_blocks, as a subscriber does.
ReadMesh assembledFromChunks(const MeshStore& store) {
  constexpr int kChunkBlocks = 4;
  const ChunkLattice lattice(store.voxelSize(), kChunkBlocks);
  MeshChunks chunks(kChunkBlocks);
  for (const auto& [key, block] : store.blocks()) chunks.markChanged(block->key);
  ReadMesh mesh;
  for (const PackedKey key : chunks.all()) {
    const PackedChunk chunk = packChunk(store, lattice, chunks.cornerOf(key), chunks.blocksOf(key));
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (size_t i = 0; i < chunk.vertexCount(); ++i) {
      const auto p_W = positionOf(chunk, lattice.step_m, i);
      const Vec3f n = normalOfPacked(chunk.normals[2 * i], chunk.normals[2 * i + 1]);
      mesh.positions.emplace_back(p_W[0], p_W[1], p_W[2]);
      mesh.normals.emplace_back(n.x, n.y, n.z);
    }
    for (size_t t = 0; t < chunk.triangleCount(); ++t) {
      mesh.triangles.push_back({first + chunk.corner(3 * t), first + chunk.corner(3 * t + 1),
                                first + chunk.corner(3 * t + 2)});
    }
  }
  return mesh;
}

/// Errors in the wall's mesh, away from the border of the measured area.
struct Quality {
  size_t triangles = 0, without_area = 0;  ///< In the whole mesh.
  size_t inner_vertices = 0;
  double max_m = 0.0, min_cosine = 1.0;
};

Quality measure(const ReadMesh& mesh, const Wall& wall) {
  Quality quality;
  quality.triangles = mesh.triangles.size();
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.positions[t[0]];
    const Vector3d n = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
    quality.without_area += n.norm() == 0.0;
  }
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vector3d local = mesh.positions[i] - wall.shift_W;
    if (std::abs(local.y()) > 0.5 || std::abs(local.z()) > 0.4) continue;
    ++quality.inner_vertices;
    quality.max_m = std::max(quality.max_m, std::abs(wall.distance(mesh.positions[i])));
    quality.min_cosine = std::min(quality.min_cosine, mesh.normals[i].dot(wall.normal_W));
  }
  return quality;
}

void expectAsGood(const Quality& far, const Quality& near) {
  EXPECT_EQ(far.triangles, near.triangles);
  EXPECT_GT(far.inner_vertices, 3000u);
  EXPECT_LT(near.max_m, kMapError_m);
  EXPECT_LT(far.max_m, near.max_m + kMaxError_m);
  EXPECT_GT(far.min_cosine, near.min_cosine - 1e-3);
  EXPECT_LE(far.without_area, near.without_area + kMaxThinTriangles);
}

class FarFromOrigin : public testing::TestWithParam<double> {
 protected:
  static Vector3d shift() { return GetParam() * Vector3d(1.0, -0.5, 0.25); }
};

TEST_P(FarFromOrigin, ChunksAreAsGoodAsNearby) {
  const Wall far(shift()), near(Vector3d::Zero());
  expectAsGood(measure(assembledFromChunks(far.map()), far),
               measure(assembledFromChunks(near.map()), near));
}

/// A mesh far from the map's origin matches a mesh near it, but its vertices have another origin.
TEST_P(FarFromOrigin, NormalsAndTrianglesMatchThoseNearby) {
  const Mesh near = Wall(Vector3d::Zero()).map().assemble();
  const Mesh far = Wall(shift()).map().assemble();
  EXPECT_FALSE(isFarFromOrigin(near));
  EXPECT_TRUE(isFarFromOrigin(far));
  ASSERT_EQ(far.triangles.size(), near.triangles.size());
  ASSERT_EQ(far.vertices_m.size(), near.vertices_m.size());
  for (size_t i = 0; i < far.vertices_m.size(); ++i) {
    const auto p = positionInMap(far, i), q = positionInMap(near, i);
    for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(p[axis] - shift()[axis], q[axis], 1e-5);
    ASSERT_GT(dot(far.normals[i], near.normals[i]), 0.99999f);
  }
}

INSTANTIATE_TEST_SUITE_P(Metres, FarFromOrigin, testing::Values(128.0, 10240.0, 40960.0, 102400.0));

TEST(FarFromOriginInRegions, TriangleCountMatchesThatNearby) {
  const Vector3d shift(40960.0, -20480.0, 0.0);
  BoxRegion box;
  box.size_m = Vector3d(4.0, 0.6, 0.6);
  box.T_W_B.translation() = Vector3d(1.5, 0.0, 0.0);
  const size_t near = Wall(Vector3d::Zero()).map().assemble(box).triangles.size();
  box.T_W_B.translation() += shift;
  EXPECT_GT(near, 500u);
  EXPECT_EQ(Wall(shift).map().assemble(box).triangles.size(), near);
}

}  // namespace
}  // namespace dtsdf
