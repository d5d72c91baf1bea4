// Tests that packed meshes of whole maps stay close to the original meshes, and that neighbouring
// chunks still meet.
#include "meshing/packed_chunk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "kernels/core/grid.h"
#include "meshing/mesh_chunks.h"
#include "support/depth_frames.h"
#include "support/mesh_topology.h"
#include "support/random_vectors.h"
#include "support/raw_mesh.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;
using Point = std::array<double, 3>;

constexpr float kVoxelSize = 0.02f;

MeshUpdate meshOfABall(int refine) {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, kVoxelSize, 2);
  params.mesh.refine = refine;
  const Vector3d centre(0.13, -0.07, 0.21);
  Scene scene;
  scene.add(Sphere{centre, 0.4});
  const auto mapper = makeProbedMapper(params);
  for (const SceneFrame& frame : renderFrames(scene, sphereOfPoses(centre, 1.1, 24))) {
    mapper->integrate(frame.view());
  }
  return mapper->updateMesh();
}

MeshStore storeOf(const MeshUpdate& update, float voxel_size_m = kVoxelSize) {
  MeshStore store(voxel_size_m);
  store.apply(update);
  return store;
}

std::vector<PackedChunk> packAll(const MeshStore& store, int chunk_blocks) {
  const ChunkLattice lattice(store.voxelSize(), chunk_blocks);
  MeshChunks chunks(chunk_blocks);
  for (const auto& [key, block] : store.blocks()) chunks.markChanged(block->key);
  return packChunks(store, lattice, chunks, chunks.all(), 2);
}

/// Joins the triangles of all chunks and merges vertices with equal positions.
Mesh joinByPlace(const std::vector<PackedChunk>& chunks, double step_m) {
  std::map<Point, uint32_t> numbers;
  Mesh mesh;
  for (const PackedChunk& chunk : chunks) {
    for (size_t t = 0; t < chunk.triangleCount(); ++t) {
      Triangle triangle;
      for (size_t k = 0; k < 3; ++k) {
        const Point p_W = positionOf(chunk, step_m, chunk.corner(3 * t + k));
        triangle[k] = numbers.emplace(p_W, static_cast<uint32_t>(numbers.size())).first->second;
      }
      mesh.triangles.push_back(triangle);
    }
  }
  mesh.vertices_m.resize(numbers.size());
  for (const auto& [p_W, number] : numbers) {
    mesh.vertices_m[number] = {static_cast<float>(p_W[0]), static_cast<float>(p_W[1]),
                               static_cast<float>(p_W[2])};
  }
  return mesh;
}

class PackedBall : public testing::TestWithParam<int> {};

TEST_P(PackedBall, IsClosedAcrossChunksOfAnySize) {
  const MeshStore store = storeOf(meshOfABall(GetParam()));
  for (const int chunk_blocks : {1, 3, 4, 64}) {
    const ChunkLattice lattice(kVoxelSize, chunk_blocks);
    const Mesh mesh = joinByPlace(packAll(store, chunk_blocks), lattice.step_m);
    EXPECT_EQ(mesh.triangles.size(), store.triangleCount());
    const MeshTopology topology = measureTopology(mesh.triangles);
    EXPECT_TRUE(topology.isClosedManifold()) << topology << ", chunks of " << chunk_blocks;
  }
}

TEST_P(PackedBall, IsAtMostHalfAStepFromTheMesh) {
  const MeshStore store = storeOf(meshOfABall(GetParam()));
  for (const int chunk_blocks : {1, 4, 64}) {
    const ChunkLattice lattice(kVoxelSize, chunk_blocks);
    MeshChunks chunks(chunk_blocks);
    for (const auto& [key, block] : store.blocks()) chunks.markChanged(block->key);
    for (const PackedKey key : chunks.all()) {
      const PackedChunk packed =
          packChunk(store, lattice, chunks.cornerOf(key), chunks.blocksOf(key));
      // A closed mesh has no outline to smooth. Vertices where chunks meet stay in place.
      const Mesh mesh = rawMesh(store, chunks.blocksOf(key));
      ASSERT_EQ(packed.vertexCount(), mesh.vertices_m.size());
      ASSERT_EQ(packed.triangleCount(), mesh.triangles.size());
      for (size_t i = 0; i < packed.vertexCount(); ++i) {
        const Point p_W = positionOf(packed, lattice.step_m, i);
        const Vec3f& p = mesh.vertices_m[i];
        const double tolerance = 0.5 * lattice.step_m + 1e-7;
        ASSERT_NEAR(p_W[0], p.x, tolerance);
        ASSERT_NEAR(p_W[1], p.y, tolerance);
        ASSERT_NEAR(p_W[2], p.z, tolerance);
        const Vec3f n = normalOfPacked(packed.normals[2 * i], packed.normals[2 * i + 1]);
        ASSERT_GT(dot(n, mesh.normals[i]), 0.999999f);
      }
      for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (size_t k = 0; k < 3; ++k) {
          ASSERT_EQ(packed.corner(3 * t + k), mesh.triangles[t][k]);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, PackedBall, testing::Values(0, 1),
                         [](const auto& info) { return info.param == 0 ? "plain" : "refined"; });

/// Vertices that several chunks share stay in place, although each chunk mends its own outlines.
TEST(PackedChunks, MeetWhereTheMeshEnds) {
  const Vector3d centre(0.01, 0.02, 0.033);
  Scene scene;
  scene.add(Plane{centre, Vector3d::UnitZ()});
  const auto mapper =
      makeProbedMapper(makeCpuParams(FusionMode::kNormalRayCasting, true, kVoxelSize, 2));
  mapper->integrate(renderFrames(scene, {sphereOfPoses(centre, 1.1, 24)[3]})[0].view());
  const MeshStore store = storeOf(mapper->updateMesh());
  for (const int chunk_blocks : {1, 2, 4}) {
    const ChunkLattice lattice(kVoxelSize, chunk_blocks);
    MeshChunks chunks(chunk_blocks);
    for (const auto& [key, block] : store.blocks()) chunks.markChanged(block->key);
    std::map<Point, std::vector<Point>> packed_at;  // for each vertex, its places in all chunks
    std::map<Point, size_t> users;                  // for each vertex, the chunks that use it
    for (const PackedKey key : chunks.all()) {
      const Mesh raw = rawMesh(store, chunks.blocksOf(key));
      const PackedChunk packed =
          packChunk(store, lattice, chunks.cornerOf(key), chunks.blocksOf(key));
      std::set<Point> used;
      for (const Triangle& triangle : raw.triangles) {
        for (const uint32_t v : triangle) {
          const Vec3f& p = raw.vertices_m[v];
          used.insert({p.x, p.y, p.z});
        }
      }
      for (const Point& p : used) {
        ++users[p];
        for (size_t i = 0; i < packed.vertexCount(); ++i) {
          const Point at = positionOf(packed, lattice.step_m, i);
          const auto isNear = [&](size_t axis) {
            return std::abs(at[axis] - p[axis]) <= 0.5 * lattice.step_m + 1e-7;
          };
          if (isNear(0) && isNear(1) && isNear(2)) packed_at[p].push_back(at);
        }
      }
    }
    size_t shared = 0;
    for (const auto& [p, count] : users) {
      if (count < 2) continue;
      ++shared;
      const std::vector<Point>& places = packed_at[p];
      EXPECT_GE(places.size(), count) << "chunks of " << chunk_blocks;
      EXPECT_EQ(std::set<Point>(places.begin(), places.end()).size(), 1u);
    }
    EXPECT_GT(shared, 50u) << "chunks of " << chunk_blocks;
  }
}

/// Consecutive floats near 40 km are 4 mm apart.
TEST(PackedChunks, AreTheSameFortyKilometresAway) {
  const MeshUpdate near = meshOfABall(0);
  MeshUpdate far = near;
  const int blocks_away = 250000;  // 40 km
  for (BlockMesh& block : far.blocks) block.key = block.key + Vec3i{blocks_away, -blocks_away, 0};
  const std::vector<PackedChunk> here = packAll(storeOf(near), 4), there = packAll(storeOf(far), 4);
  const ChunkLattice lattice(kVoxelSize, 4);
  const double away_m = static_cast<double>(kVoxelSize) * kBlockSide * blocks_away;
  ASSERT_EQ(here.size(), there.size());
  for (size_t c = 0; c < here.size(); ++c) {
    EXPECT_EQ(here[c].positions, there[c].positions);
    EXPECT_EQ(here[c].normals, there[c].normals);
    EXPECT_EQ(here[c].triangles16, there[c].triangles16);
    if (here[c].vertexCount() == 0) continue;
    const Point p = positionOf(here[c], lattice.step_m, 0);
    const Point q = positionOf(there[c], lattice.step_m, 0);
    EXPECT_NEAR(q[0] - p[0], away_m, 1e-9);
    EXPECT_NEAR(q[1] - p[1], -away_m, 1e-9);
    EXPECT_EQ(q[2], p[2]);
  }
}

/// A square in the layer z = 3 of a block, with its vertices on the edges along z.
BlockMesh squareIn(const BlockKey& key) {
  BlockMesh mesh;
  mesh.key = key;
  for (const auto& [x, y] : {std::pair{0, 0}, {8, 0}, {8, 8}, {0, 8}}) {
    mesh.vertices.push_back({{static_cast<float>(x), static_cast<float>(y), 3.5f},
                             static_cast<uint32_t>(6 * (x + 9 * (y + 9 * 3)) + 4)});
  }
  std::swap(mesh.vertices[2], mesh.vertices[3]);  // sorted by edge
  mesh.triangles = {0, 1, 3, 0, 3, 2};
  return mesh;
}

TEST(PackedChunks, UseWideIndicesOnlyIfNeeded) {
  // These blocks have no vertices on their upper faces, so they share no vertices.
  const auto chunkWith = [](int blocks) {
    MeshStore store(kVoxelSize);
    std::vector<PackedKey> keys;
    for (int n = 0; n < blocks; ++n) {
      BlockMesh block;
      block.key = {n % 64, n / 64, 0};
      for (uint16_t i = 0; i < 512; ++i) {
        const uint32_t corner = i % 8u + 9 * (i / 8u % 8 + 9 * (i / 64u));
        block.vertices.push_back({{1.0f, 2.0f, 3.0f}, 6 * corner});
        if (i < 2) continue;
        for (const int back : {1 + i % 2, 2 - i % 2, 0}) {
          block.triangles.push_back(static_cast<uint16_t>(i - back));
        }
      }
      keys.push_back(packedKeyOf(block.key));
      store.put(std::make_shared<const BlockMesh>(block));
    }
    return packChunk(store, ChunkLattice(kVoxelSize, 64), {0, 0, 0}, keys);
  };
  const PackedChunk narrow = chunkWith(128), wide = chunkWith(129);
  EXPECT_EQ(narrow.vertexCount(), 65536u);
  EXPECT_EQ(narrow.triangles16.size(), 3u * 128u * 510u);
  EXPECT_TRUE(narrow.triangles32.empty());
  EXPECT_EQ(narrow.corner(narrow.triangles16.size() - 1), 65535u);
  EXPECT_TRUE(wide.triangles16.empty());
  EXPECT_EQ(wide.triangleCount(), 129u * 510u);
  EXPECT_EQ(wide.corner(wide.triangles32.size() - 1), 129u * 512u - 1);
}

TEST(PackedChunks, HaveColoursIfAnyBlockIsPainted) {
  const ChunkLattice lattice(kVoxelSize, 4);
  MeshUpdate update;
  update.blocks = {squareIn({0, 0, 0}), squareIn({2, 0, 0})};
  const std::vector<PackedKey> keys = {packedKeyOf({0, 0, 0}), packedKeyOf({2, 0, 0})};
  EXPECT_TRUE(packChunk(storeOf(update), lattice, {0, 0, 0}, keys).colours.empty());
  update.blocks[1].colours = {{10, 20, 30, 255}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}};
  const PackedChunk chunk = packChunk(storeOf(update), lattice, {0, 0, 0}, keys);
  ASSERT_EQ(chunk.colours.size(), 3 * chunk.vertexCount());
  const std::vector<uint8_t> of_second(chunk.colours.begin() + 12, chunk.colours.begin() + 18);
  EXPECT_EQ(of_second, (std::vector<uint8_t>{10, 20, 30, 200, 200, 200}));
  const Mesh mesh = unpackChunk(chunk, lattice.step_m);
  EXPECT_EQ(vertexColour(MeshColour::kImage, mesh, 4), (std::array<uint8_t, 3>{10, 20, 30}));
}

TEST(PackedNormals, AreOffByLessThanATenThousandth) {
  std::mt19937 random(1);
  float worst = 0.0f;
  const auto check = [&](const Vec3f& n) {
    const auto [u, v] = packedNormal(n);
    worst = std::max(worst, norm(normalOfPacked(u, v) - n));
  };
  for (int i = 0; i < 100000; ++i) check(randomUnit(random));
  for (const float sign : {-1.0f, 1.0f}) {
    check({sign, 0.0f, 0.0f});
    check({0.0f, sign, 0.0f});
    check({0.0f, 0.0f, sign});
  }
  EXPECT_LT(worst, 1e-4f);
}

}  // namespace
}  // namespace dtsdf
