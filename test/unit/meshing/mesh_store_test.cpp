#include "dtsdf_mapping/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "kernels/meshing/edge_vertex.h"
#include "meshing/mesh_stream.h"
#include "support/grid_mesh.h"
#include "support/mesh_topology.h"
#include "support/raw_mesh.h"
#include "support/same_bytes.h"

namespace dtsdf {
namespace {

constexpr float kVoxelSize = 0.05f;

/// A block's part of the plane z = height, with free space above it. `height` is in voxels above
/// the block's first voxel and must not be an integer.
BlockMesh planeBlock(const BlockKey& key, float height) {
  BlockMesh mesh;
  mesh.key = key;
  const int layer = floorToInt(height);
  for (int y = 0; y < kCornerGridSide; ++y) {
    for (int x = 0; x < kCornerGridSide; ++x) {
      const int edge = edgeNumber(cornerIndex(x, y, layer), 2, 0);
      mesh.vertices.push_back(
          {vertexPosition(edge, height - static_cast<float>(layer)), static_cast<uint32_t>(edge)});
    }
  }
  mesh.triangles = gridTriangles(kCornerGridSide);
  return mesh;
}

MeshUpdate updateOf(std::vector<BlockMesh> blocks) {
  MeshUpdate update;
  update.blocks = std::move(blocks);
  return update;
}

constexpr size_t kTriangles = 2 * kBlockSide * kBlockSide;

TEST(MeshStore, AddsReplacesAndDeletes) {
  MeshStore store(kVoxelSize);
  EXPECT_EQ(store.triangleCount(), 0u);
  EXPECT_TRUE(store.assemble().triangles.empty());
  store.apply(updateOf({planeBlock({0, 0, 0}, 2.5f), planeBlock({5, 0, -1}, 2.5f)}));
  EXPECT_EQ(store.blocks().size(), 2u);
  EXPECT_EQ(store.triangleCount(), 2 * kTriangles);

  BlockMesh half = planeBlock({0, 0, 0}, 6.25f);
  half.triangles.resize(kTriangles / 2 * 3);
  store.apply(updateOf({half}));
  EXPECT_EQ(store.blocks().size(), 2u);
  EXPECT_EQ(store.triangleCount(), kTriangles + kTriangles / 2);
  EXPECT_EQ(store.blocks().at(packKey({0, 0, 0}))->vertices[0].position.z, 6.25f);

  BlockMesh vanished;
  vanished.key = {0, 0, 0};
  store.apply(updateOf({vanished}));
  EXPECT_EQ(store.blocks().size(), 1u);
  EXPECT_EQ(store.triangleCount(), kTriangles);
  store.apply(updateOf({vanished}));  // no longer in the store
  EXPECT_EQ(store.triangleCount(), kTriangles);

  store.clear();
  EXPECT_TRUE(store.blocks().empty());
  EXPECT_EQ(store.triangleCount(), 0u);
}

TEST(MeshStore, SharesBlocksWithItsCopies) {
  MeshStore store(kVoxelSize);
  const auto block = std::make_shared<const BlockMesh>(planeBlock({1, 2, 3}, 2.5f));
  store.put(block);
  EXPECT_EQ(store.blocks().at(packKey({1, 2, 3})), block);
  const MeshStore snapshot = store;
  store.clear();
  EXPECT_EQ(snapshot.blocks().at(packKey({1, 2, 3})), block);
  EXPECT_EQ(snapshot.triangleCount(), kTriangles);
}

/// 2 x 2 blocks around the origin form one sheet without duplicate vertices.
TEST(MeshStore, AssemblyWeldsAcrossBlocks) {
  MeshStore store(kVoxelSize);
  for (const int y : {-1, 0}) {
    for (const int x : {-1, 0}) store.apply(updateOf({planeBlock({x, y, -1}, 3.5f)}));
  }
  const Mesh mesh = store.assemble();
  constexpr size_t kSide = 2 * kBlockSide;
  EXPECT_EQ(mesh.vertices_m.size(), (kSide + 1) * (kSide + 1));
  EXPECT_EQ(mesh.triangles.size(), 4 * kTriangles);
  const MeshTopology topology = measureTopology(mesh);
  EXPECT_EQ(topology.boundary_edges, 4 * kSide) << topology;
  EXPECT_EQ(topology.nonmanifold_edges + topology.inconsistent_edges, 0u) << topology;
  EXPECT_EQ(topology.coincident_vertices + topology.unused_vertices, 0u) << topology;
  const auto farthest = [](const Mesh& sheet) {
    float most = 0.0f;
    for (const Vec3f& p : sheet.vertices_m) {
      EXPECT_FLOAT_EQ(p.z, (-8.0f + 3.5f) * kVoxelSize);
      most = std::max({most, std::abs(p.x), std::abs(p.y)});
    }
    return most;
  };
  EXPECT_LE(farthest(rawMesh(store)), 8 * kVoxelSize);
  EXPECT_FLOAT_EQ(farthest(mesh), (8.0f + 1.0f / 16.0f) * kVoxelSize);
}

/// Surfaces with holes everywhere, stacked or in one long strip. Outlines extend over several of
/// the pieces in which MeshStream returns the mesh.
TEST(MeshStore, IsTheSameInPieces) {
  for (const Vec3i& blocks : {Vec3i{6, 6, 50}, Vec3i{200, 3, 1}}) {
    MeshStore store(kVoxelSize);
    std::mt19937 random(4);
    for (int n = 0; n < blocks.x * blocks.y * blocks.z; ++n) {
      const BlockKey key{n % blocks.x, n / blocks.x % blocks.y, n / (blocks.x * blocks.y)};
      BlockMesh block = planeBlock(key, 3.5f);
      std::vector<uint16_t> kept;
      for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
        if (random() % 8 == 0) continue;
        kept.insert(kept.end(), &block.triangles[t], &block.triangles[t] + 3);
      }
      block.triangles = kept;
      store.apply(updateOf({block}));
    }
    const Mesh mesh = store.assemble(), raw = rawMesh(store);
    EXPECT_LT(mesh.vertices_m.size(), raw.vertices_m.size()) << "crumbs should be removed";
    EXPECT_GT(mesh.triangles.size(), raw.triangles.size() + 1000) << "holes should be closed";
    Mesh in_pieces;
    int pieces = 0;
    MeshStream stream(kVoxelSize, false, {{0, 0, 0}, blocks - Vec3i{1, 1, 1}},
                      {[&](const Mesh& piece) {
                         ++pieces;
                         for (const Vec3f& p : piece.vertices_m) in_pieces.vertices_m.push_back(p);
                       },
                       [&](const auto& t) { in_pieces.triangles.push_back(t); }},
                      1000);
    for (const auto& [key, block] : store.blocks()) stream.add(*block);
    stream.finish();
    EXPECT_GT(pieces, 3);
    EXPECT_TRUE(sameBytes(in_pieces.vertices_m, mesh.vertices_m));
    EXPECT_EQ(in_pieces.triangles, mesh.triangles);
  }
}

/// The two sides of a wall cross the same grid edges, but their vertices must not be merged.
TEST(MeshStore, AssemblyKeepsTheTwoFacingsApart) {
  BlockMesh block = planeBlock({0, 0, 0}, 3.5f);
  const size_t one_side = block.vertices.size(), corners = block.triangles.size();
  for (size_t i = 0; i < one_side; ++i) {
    BlockVertex vertex = block.vertices[i];
    vertex.edge += 1;
    block.vertices.push_back(vertex);
  }
  for (size_t i = 0; i < corners; i += 3) {
    for (const size_t k : {i, i + 2, i + 1}) {
      block.triangles.push_back(static_cast<uint16_t>(block.triangles[k] + one_side));
    }
  }
  MeshStore store(kVoxelSize);
  store.apply(updateOf({block}));
  const Mesh mesh = store.assemble();
  ASSERT_EQ(mesh.vertices_m.size(), 2 * one_side);
  for (size_t i = 0; i < mesh.normals.size(); ++i) {
    EXPECT_FLOAT_EQ(mesh.normals[i].z, i < one_side ? 1.0f : -1.0f);  // towards free space
  }
}

/// A border vertex that is moved to its measured point may pass the opposite side of its triangle.
/// The facing of the vertex then decides which side of the triangle is the front.
TEST(MeshStore, NormalsOfFoldedTrianglesAreFlipped) {
  BlockMesh block = planeBlock({0, 0, 0}, 3.5f);
  ASSERT_FLOAT_EQ(block.vertices[0].position.x, 0.0f);
  block.vertices[0].position = block.vertices[0].position + Vec3f{1.5f, 0.9f, 0.0f};
  MeshStore store(kVoxelSize);
  store.apply(updateOf({block}));
  for (const Vec3f& n : store.assemble().normals) EXPECT_FLOAT_EQ(n.z, 1.0f);
}

/// If a mesh extends more than 64 m from the map's origin, its vertices are relative to its own
/// centre, rounded to whole metres.
TEST(MeshStore, MeshesFarAwayHaveTheirOwnOrigin) {
  const auto meshOf = [](std::vector<int> xs) {
    MeshStore store(0.125f);  // 1 m blocks
    for (const int x : xs) store.apply(updateOf({planeBlock({x, 0, -3}, 3.5f)}));
    return store.assemble();
  };
  EXPECT_FALSE(isFarFromOrigin(meshOf({-64, 63})));
  EXPECT_TRUE(isFarFromOrigin(meshOf({0, 64})));
  EXPECT_TRUE(isFarFromOrigin(meshOf({-65, 0})));
  const Mesh mesh = meshOf({1000, 1005});
  EXPECT_EQ(mesh.origin_m[0], 1003.0);
  const size_t inside = kCornerGridSide + 1;
  EXPECT_EQ(mesh.vertices_m[inside].x, -2.875f);
  EXPECT_EQ(positionInMap(mesh, inside), (std::array<double, 3>{1000.125, 0.125, -2.5625}));
}

/// Blocks meshed before the first colour image are joined with painted blocks.
TEST(MeshStore, JoinsBlocksWithAndWithoutColours) {
  MeshStore store(kVoxelSize);
  const auto block = [](int x, std::vector<VertexColour> colours) {
    BlockMesh mesh = planeBlock({2 * x, 0, 0}, 3.5f);
    if (!colours.empty()) colours.resize(mesh.vertices.size());
    mesh.colours = std::move(colours);
    return std::make_shared<const BlockMesh>(mesh);
  };
  store.put(block(0, {}));
  const size_t count = store.assemble().vertices_m.size();
  EXPECT_TRUE(store.assemble().colours.empty());
  store.put(block(1, {{1, 2, 3, 255}, {4, 5, 6, 255}, {7, 8, 9, 255}}));
  store.put(block(2, {}));
  const Mesh mesh = store.assemble();
  ASSERT_EQ(mesh.vertices_m.size(), 3 * count);
  ASSERT_EQ(mesh.colours.size(), 3 * count);
  EXPECT_EQ(mesh.colours[2].painted, 0);
  EXPECT_EQ(mesh.colours[count + 1].green, 5);
  EXPECT_EQ(mesh.colours[2 * count].painted, 0);
}

std::array<uint8_t, 3> colourOf(MeshColour mode, const Vec3f& p_W, const Vec3f& normal_W) {
  Mesh mesh;
  mesh.vertices_m.push_back(p_W);
  mesh.normals.push_back(normal_W);
  return vertexColour(mode, mesh, 0);
}

TEST(VertexColour, IsFromImagesWherePainted) {
  using Rgb = std::array<uint8_t, 3>;
  Mesh mesh;
  mesh.vertices_m.assign(2, {0, 0, 0});
  mesh.normals.assign(2, {1, 0, 0});
  const Rgb normal = vertexColour(MeshColour::kNormal, mesh, 0);
  const Rgb plain = vertexColour(MeshColour::kPlain, mesh, 0);
  EXPECT_EQ(vertexColour(MeshColour::kAuto, mesh, 0), normal);
  EXPECT_EQ(vertexColour(MeshColour::kImage, mesh, 0), plain);
  mesh.colours = {{10, 20, 30, 255}, {0, 0, 0, 0}};
  EXPECT_EQ(vertexColour(MeshColour::kAuto, mesh, 0), (Rgb{10, 20, 30}));
  EXPECT_EQ(vertexColour(MeshColour::kImage, mesh, 0), (Rgb{10, 20, 30}));
  EXPECT_EQ(vertexColour(MeshColour::kAuto, mesh, 1), plain);
  EXPECT_EQ(vertexColour(MeshColour::kNormal, mesh, 1), normal);
}

TEST(VertexColour, NormalsAreRedGreenBlue) {
  using Rgb = std::array<uint8_t, 3>;
  const Vec3f origin{0, 0, 0};
  EXPECT_EQ(colourOf(MeshColour::kNormal, origin, {1, 0, 0}), (Rgb{255, 128, 128}));
  EXPECT_EQ(colourOf(MeshColour::kNormal, origin, {0, -1, 0}), (Rgb{128, 0, 128}));
  EXPECT_EQ(colourOf(MeshColour::kNormal, origin, {0, 0, 1}), (Rgb{128, 128, 255}));
}

/// Each height has a saturated hue. Hues change continuously with height.
TEST(VertexColour, HeightsAreAContinuousRainbow) {
  std::set<std::array<uint8_t, 3>> colours;
  auto previous = colourOf(MeshColour::kHeight, {0, 0, -5.0f}, {0, 0, 1});
  for (float z = -5.0f; z < 5.0f; z += 0.001f) {
    const auto colour = colourOf(MeshColour::kHeight, {3.0f, -2.0f, z}, {1, 0, 0});
    EXPECT_EQ(*std::max_element(colour.begin(), colour.end()), 255);
    EXPECT_EQ(*std::min_element(colour.begin(), colour.end()), 0);
    for (size_t i = 0; i < 3; ++i) EXPECT_LE(std::abs(colour[i] - previous[i]), 2) << "z = " << z;
    colours.insert(colour);
    previous = colour;
  }
  EXPECT_GT(colours.size(), 1000u);
}

}  // namespace
}  // namespace dtsdf
