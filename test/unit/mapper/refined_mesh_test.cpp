// Tests refined meshes of whole maps: their topology and the positions of their vertices.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>
#include <tuple>
#include <vector>

#include "support/depth_frames.h"
#include "support/mesh_topology.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;
using Position = std::tuple<float, float, float>;

constexpr uint32_t kFirstMiddle = 4374;  // see dtsdf_mapping/block_mesh.h

Position asTuple(const Vec3f& p) { return {p.x, p.y, p.z}; }

std::vector<SceneFrame> framesAround(const Scene& scene, const Vector3d& centre) {
  return renderFrames(scene, sphereOfPoses(centre, 1.1, 24));
}

/// Tests a directional and an undirected map.
class RefinedMesh : public testing::TestWithParam<bool> {
 protected:
  MapperParams params(int refine, int threads = 2, float voxel_size_m = 0.02f) const {
    MapperParams params =
        makeCpuParams(FusionMode::kNormalRayCasting, GetParam(), voxel_size_m, threads);
    params.mesh.refine = refine;
    params.mesh.min_support = 1;
    return params;
  }
};

MeshUpdate fuseAndMesh(const MapperParams& params, const std::vector<SceneFrame>& frames) {
  const auto mapper = makeProbedMapper(params);
  for (const SceneFrame& frame : frames) mapper->integrate(frame.view());
  return mapper->updateMesh();
}

/// The midpoints of the straight sides of a mesh's triangles.
Mesh straightMiddles(const Mesh& mesh) {
  Mesh middles;
  for (const Triangle& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const Vec3f &a = mesh.vertices_m[t[i]], &b = mesh.vertices_m[t[(i + 1) % 3]];
      middles.vertices_m.push_back({0.5f * (a.x + b.x), 0.5f * (a.y + b.y), 0.5f * (a.z + b.z)});
    }
  }
  return middles;
}

Mesh verticesBeside(const Mesh& mesh, const Mesh& other) {
  std::set<Position> known;
  for (const Vec3f& p : other.vertices_m) known.insert(asTuple(p));
  Mesh beside;
  for (const Vec3f& p : mesh.vertices_m) {
    if (known.count(asTuple(p)) == 0) beside.vertices_m.push_back(p);
  }
  return beside;
}

/// The mesh is closed across blocks, even one kilometre from the origin, where positions are
/// rounded to 2^-14 m.
TEST_P(RefinedMesh, OfABallIsClosed) {
  for (const Vector3d& centre : {Vector3d(0.13, -0.07, 0.21), Vector3d(1000.13, -700.07, 30.21)}) {
    const std::vector<SceneFrame> frames = framesAround(
        [&] {
          Scene scene;
          scene.add(Sphere{centre, 0.4});
          return scene;
        }(),
        centre);
    const Mesh plain = reconstruct(params(0), frames), mesh = reconstruct(params(1), frames);
    const MeshTopology topology = measureTopology(mesh);
    EXPECT_TRUE(topology.isClosedManifold()) << topology;
    EXPECT_EQ(topology.repeated_corners + topology.unused_vertices, 0u) << topology;
    EXPECT_EQ(mesh.triangles.size(), 4 * plain.triangles.size());
    // Euler: V - E + F = 2 for one closed surface without handles, and 3 F = 2 E.
    EXPECT_EQ(mesh.vertices_m.size() - mesh.triangles.size() / 2, 2u);
  }
}

double meanRadius(const Mesh& mesh, const Vector3d& centre) {
  double sum = 0.0;
  for (const Vec3f& p : mesh.vertices_m) sum += (Vector3d(p.x, p.y, p.z) - centre).norm();
  return sum / static_cast<double>(mesh.vertices_m.size());
}

/// New vertices lie as far from the ball's centre as the vertices of the plain mesh; the midpoints
/// of straight sides do not.
TEST_P(RefinedMesh, OfABallIsRoundBetweenVertices) {
  const Vector3d centre(0.13, -0.07, 0.21);
  Scene scene;
  scene.add(Sphere{centre, 0.2});
  const std::vector<SceneFrame> frames = framesAround(scene, centre);
  const Mesh plain = reconstruct(params(0), frames), mesh = reconstruct(params(1), frames);
  const double vertices_m = meanRadius(plain, centre);
  const double sagitta_m = vertices_m - meanRadius(straightMiddles(plain), centre);
  const double rest_m = vertices_m - meanRadius(verticesBeside(mesh, plain), centre);
  EXPECT_GT(sagitta_m, 1e-4);
  EXPECT_LT(std::abs(rest_m), 0.2 * sagitta_m);
}

/// The vertices on grid edges come first and equal those of the plain mesh. The `edge` of each
/// midpoint encodes the edges of the two vertices between which it lies.
TEST_P(RefinedMesh, KeepsTheVerticesOfThePlainMesh) {
  const std::vector<SceneFrame> frames = {renderFrame(makeRoomScene(), roomCameraPose(2.0))};
  const MeshUpdate plain = fuseAndMesh(params(0), frames), mesh = fuseAndMesh(params(1), frames);
  ASSERT_GT(plain.blocks.size(), 100u);
  ASSERT_EQ(mesh.blocks.size(), plain.blocks.size());
  for (size_t i = 0; i < mesh.blocks.size(); ++i) {
    const BlockMesh &coarse = plain.blocks[i], &fine = mesh.blocks[i];
    ASSERT_EQ(packedKeyOf(fine.key), packedKeyOf(coarse.key));
    ASSERT_EQ(fine.triangles.size(), 4 * coarse.triangles.size());
    ASSERT_GT(fine.vertices.size(), coarse.vertices.size());
    ASSERT_EQ(std::memcmp(fine.vertices.data(), coarse.vertices.data(),
                          coarse.vertices.size() * sizeof(BlockVertex)),
              0);
    std::set<uint32_t> edges;
    for (const BlockVertex& vertex : coarse.vertices) edges.insert(vertex.edge);
    for (size_t v = coarse.vertices.size(); v < fine.vertices.size(); ++v) {
      ASSERT_GE(fine.vertices[v].edge, kFirstMiddle);
      const uint32_t ends = fine.vertices[v].edge - kFirstMiddle;
      ASSERT_TRUE(edges.count(ends / kFirstMiddle) && edges.count(ends % kFirstMiddle));
      ASSERT_LT(ends / kFirstMiddle, ends % kFirstMiddle);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Maps, RefinedMesh, testing::Bool(),
                         [](const testing::TestParamInfo<bool>& info) {
                           return info.param ? "Directional" : "Undirected";
                         });

}  // namespace
}  // namespace dtsdf
