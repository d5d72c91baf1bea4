// A wall tens of kilometres from the origin of the map: its mesh, in files and in chunks as they
// are sent, is as good as near the origin.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/core/vec.h"
#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "support/depth_frames.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// Divides whole metres, so that a wall that is shifted by these lies in the grid as before.
constexpr float kVoxel_m = 1.0f / 64.0f;
/// What the distance may add to what voxels make of a wall, which a map near by tells.
constexpr double kMostError_m = 1e-4;
constexpr double kMapError_m = 1e-3;
/// Triangles that are thinner than a float tells apart have no area, near the origin too.
constexpr size_t kFewTriangles = 5;

/// A tilted wall before a camera, both shifted.
struct Wall {
  explicit Wall(const Vector3d& shift_W)
      : shift_W(shift_W),
        normal_W(Vector3d(-1.0, 0.2, 0.1).normalized()),
        point_W(shift_W + Vector3d(1.5, 0.0, 0.0)) {}

  double distance(const Vector3d& p_W) const { return normal_W.dot(p_W - point_W); }

  MeshStore map() const {
    Scene scene;
    scene.add(Plane{point_W, normal_W});
    const auto mapper =
        makeMapper(makeCpuParams(FusionMode::kNormalRayCasting, true, kVoxel_m));
    for (const double y : {-0.1, 0.0, 0.1}) {
      const Vector3d eye_W = shift_W + Vector3d(0.0, y, 0.05);
      const Eigen::Isometry3d T_W_C =
          lookAt(eye_W, eye_W + Vector3d::UnitX(), Vector3d::UnitZ());
      EXPECT_EQ(mapper->integrate(renderFrame(scene, T_W_C).view()).status, FrameStatus::kFused);
    }
    MeshStore store(kVoxel_m);
    store.apply(mapper->updateMesh());
    return store;
  }

  Vector3d shift_W, normal_W, point_W;
};

/// A mesh as a reader has it, in double.
struct ReadMesh {
  std::vector<Vector3d> positions, normals;
  std::vector<std::array<uint32_t, 3>> triangles;
};

template <class T>
T take(const std::string& bytes, size_t& at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  at += sizeof(T);
  return value;
}

template <class T>
Vector3d takeVector(const std::string& bytes, size_t& at) {
  const auto x = take<T>(bytes, at), y = take<T>(bytes, at), z = take<T>(bytes, at);
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

/// By its header, as any reader does.
ReadMesh readPly(const std::string& bytes) {
  ReadMesh mesh;
  size_t at = bytes.find("end_header\n") + 11;
  const std::string header = bytes.substr(0, at);
  const auto count = [&](const std::string& element) {
    return std::stoul(header.substr(header.find("element " + element) + 9 + element.size()));
  };
  const bool is_double = header.find("property double x") != std::string::npos;
  for (size_t i = 0; i < count("vertex"); ++i) {
    mesh.positions.push_back(is_double ? takeVector<double>(bytes, at)
                                       : takeVector<float>(bytes, at));
    mesh.normals.push_back(takeVector<float>(bytes, at));
    at += 3;  // colour
  }
  for (size_t i = 0; i < count("face"); ++i) {
    EXPECT_EQ(take<uint8_t>(bytes, at), 3);
    mesh.triangles.push_back(take<std::array<uint32_t, 3>>(bytes, at));
  }
  EXPECT_EQ(at, bytes.size());
  return mesh;
}

ReadMesh readObj(const std::string& text) {
  ReadMesh mesh;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string kind;
    Vector3d v;
    words >> kind >> v.x() >> v.y() >> v.z();
    if (kind == "v") mesh.positions.push_back(v);
    if (kind == "vn") mesh.normals.push_back(v);
    std::array<unsigned, 6> f{};
    if (std::sscanf(line.c_str(), "f %u//%u %u//%u %u//%u", &f[0], &f[1], &f[2], &f[3], &f[4],
                    &f[5]) == 6) {
      mesh.triangles.push_back({f[0] - 1, f[2] - 1, f[4] - 1});
    }
  }
  return mesh;
}

/// What is sent as mesh_blocks, put together by a listener.
ReadMesh throughChunks(const MeshStore& store) {
  constexpr int kChunkBlocks = 4;
  const ChunkLattice lattice(store.voxelSize(), kChunkBlocks);
  MeshChunks chunks(kChunkBlocks);
  for (const auto& [key, block] : store.blocks()) chunks.markChanged(block->key);
  ReadMesh mesh;
  for (const PackedKey key : chunks.all()) {
    const PackedChunk chunk =
        packChunk(store, lattice, chunks.cornerOf(key), chunks.blocksOf(key));
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (size_t i = 0; i < chunk.vertexCount(); ++i) {
      const auto p_W = positionOf(chunk, lattice.step_m, i);
      const Vec3f n = unpackNormal(chunk.normals[2 * i], chunk.normals[2 * i + 1]);
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

/// How well a mesh shows the wall, but for the rims of what was seen.
struct Quality {
  size_t triangles = 0, without_area = 0;  ///< Of all.
  size_t inner_vertices = 0;
  double most_m = 0.0, least_cosine = 1.0;
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
    quality.most_m = std::max(quality.most_m, std::abs(wall.distance(mesh.positions[i])));
    quality.least_cosine = std::min(quality.least_cosine, mesh.normals[i].dot(wall.normal_W));
  }
  return quality;
}

void expectAsGood(const Quality& far, const Quality& near) {
  EXPECT_EQ(far.triangles, near.triangles);
  EXPECT_GT(far.inner_vertices, 3000u);
  EXPECT_LT(near.most_m, kMapError_m);
  EXPECT_LT(far.most_m, near.most_m + kMostError_m);
  EXPECT_GT(far.least_cosine, near.least_cosine - 1e-3);
  EXPECT_LE(far.without_area, near.without_area + kFewTriangles);
}

class FarFromOrigin : public testing::TestWithParam<double> {
 protected:
  static Vector3d shift() { return GetParam() * Vector3d(1.0, -0.5, 0.25); }
};

ReadMesh throughFile(const Mesh& mesh, const std::string& name) {
  const TemporaryFolder folder;
  saveMesh(mesh, MeshColour::kNormal, folder / name);
  EXPECT_EQ(lossInFormat(mesh, name), "");
  const std::string bytes = readBytes(folder / name);
  return name == "wall.ply" ? readPly(bytes) : readObj(bytes);
}

TEST_P(FarFromOrigin, FilesAndChunksAreAsGoodAsNearBy) {
  const Wall far_wall(shift()), near_wall(Vector3d::Zero());
  const MeshStore far = far_wall.map(), near = near_wall.map();
  for (const char* name : {"wall.ply", "wall.obj"}) {
    SCOPED_TRACE(name);
    expectAsGood(measure(throughFile(far.assemble(), name), far_wall),
                 measure(throughFile(near.assemble(), name), near_wall));
  }
  SCOPED_TRACE("chunks");
  const Quality chunks = measure(throughChunks(far), far_wall);
  expectAsGood(chunks, measure(throughChunks(near), near_wall));
}

/// The origin of the mesh is all that the distance changes.
TEST_P(FarFromOrigin, NormalsAndTrianglesAreThoseNearBy) {
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

TEST(FarFromOriginInStl, IsToldToLoseAndByHowMuch) {
  const Mesh near = Wall(Vector3d::Zero()).map().assemble();
  EXPECT_EQ(lossInFormat(near, "wall.stl"), "");
  const Mesh far = Wall(Vector3d(40960.0, 0.0, 0.0)).map().assemble();
  const std::string loss = lossInFormat(far, "wall.stl");
  EXPECT_NE(loss.find("2 mm off"), std::string::npos) << loss;  // floats are 4 mm apart there
  EXPECT_NE(loss.find(".ply"), std::string::npos) << loss;
}

TEST(FarFromOriginInRegions, TrianglesAreThoseOfTheBox) {
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
