// Tests that joining and saving a mesh takes at most 1.5 times the memory of the joined mesh, in
// addition to the block meshes. DTSDF_SAVE_TRIANGLES sets the number of triangles (default: 3
// million).
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/mesh_file.h"
#include "kernels/meshing/edge_vertex.h"
#include "support/grid_mesh.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr int kLayers = kBlockSide;
constexpr size_t kTrianglesPerBlock = kLayers * 2 * kBlockSide * kBlockSide;

/// A block filled with sheets, in which each vertex lies on a different edge.
SharedBlockMesh fullBlock(const BlockKey& key) {
  const auto mesh = std::make_shared<BlockMesh>();
  mesh->key = key;
  mesh->vertices.reserve(kLayers * kCornerGridSide * kCornerGridSide);
  mesh->triangles.reserve(3 * kTrianglesPerBlock);
  for (int z = 0; z < kLayers; ++z) {
    const auto first = static_cast<int>(mesh->vertices.size());
    for (int y = 0; y < kCornerGridSide; ++y) {
      for (int x = 0; x < kCornerGridSide; ++x) {
        const int edge = edgeNumber(cornerIndex(x, y, z), 2, 0);
        mesh->vertices.push_back({vertexPosition(edge, 0.4f), static_cast<uint32_t>(edge)});
      }
    }
    const std::vector<uint16_t> layer = gridTriangles(kCornerGridSide, first);
    mesh->triangles.insert(mesh->triangles.end(), layer.begin(), layer.end());
  }
  mesh->colours.assign(mesh->vertices.size(), VertexColour{10, 20, 30, 255});
  return mesh;
}

/// A value in bytes from /proc/self/status: VmRSS, the memory in use, or VmHWM, its peak.
size_t memory(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    size_t kibibytes = 0;
    if (word == name + ":" && status >> kibibytes) return kibibytes << 10;
  }
  return 0;
}

size_t bytesOf(const Mesh& mesh) {
  return mesh.vertices_m.size() * sizeof(mesh.vertices_m[0]) +
         mesh.normals.size() * sizeof(mesh.normals[0]) +
         mesh.triangles.size() * sizeof(mesh.triangles[0]) +
         mesh.colours.size() * sizeof(mesh.colours[0]);
}

TEST(SaveMemory, IsAtMostOneAndAHalfTimesTheMesh) {
  const char* const wanted = std::getenv("DTSDF_SAVE_TRIANGLES");
  const size_t triangles = wanted == nullptr ? 3000000 : std::strtoull(wanted, nullptr, 10);
  MeshStore store(0.01f);
  constexpr int kSide = 64;
  for (int i = 0; store.triangleCount() < triangles; ++i) {
    store.put(fullBlock({i % kSide, i / kSide % kSide, i / (kSide * kSide)}));
  }
  const TemporaryFolder folder;
  for (const std::string extension : {".ply", ".glb", ".stl"}) {
    std::ofstream("/proc/self/clear_refs") << 5;  // resets the peak
    const size_t before = memory("VmRSS");
    size_t mesh_bytes = 0;
    {
      const Mesh mesh = store.assemble();
      mesh_bytes = bytesOf(mesh);
      saveMesh(mesh, MeshColour::kAuto, folder / ("mesh" + extension));
    }
    const auto taken = static_cast<double>(memory("VmHWM") - before);
    const double share = taken / static_cast<double>(mesh_bytes);
    RecordProperty("share" + extension.substr(1), std::to_string(share));
    std::printf("%s with %zu triangles: %.2f times the mesh's %.0f MB\n", extension.c_str(),
                store.triangleCount(), share, static_cast<double>(mesh_bytes) / 1e6);
    EXPECT_LE(share, 1.5);
    EXPECT_GT(share, 0.25) << "the measured memory should include the mesh";
  }
}

}  // namespace
}  // namespace dtsdf
