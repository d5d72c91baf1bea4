// Fuzzes a receiver of mesh_blocks. The bytes are the step_m of a message and one MeshBlock,
// serialised as in ROS.
#include <vector>

#include "fuzz/fuzz_input.h"
#include "fuzz/mesh_check.h"
#include "meshing/packed_chunk.h"

using namespace dtsdf;

namespace {

/// Takes a length, then an array of that length. If the bytes run out, the array is shorter.
template <class Number>
std::vector<Number> takeArray(InputBytes& bytes) {
  const size_t length = bytes.take<uint32_t>();
  std::vector<Number> numbers;
  while (numbers.size() < length && bytes.left() >= sizeof(Number)) {
    numbers.push_back(bytes.take<Number>());
  }
  return numbers;
}

PackedChunk takeChunk(InputBytes& bytes) {
  PackedChunk chunk;
  for (int64_t& steps : chunk.origin) steps = bytes.take<int64_t>();
  chunk.positions = takeArray<uint16_t>(bytes);
  chunk.normals = takeArray<int16_t>(bytes);
  chunk.colours = takeArray<uint8_t>(bytes);
  chunk.triangles16 = takeArray<uint16_t>(bytes);
  chunk.triangles32 = takeArray<uint32_t>(bytes);
  return chunk;
}

/// Converts a chunk as RViz's display does.
void show(const PackedChunk& chunk, double step_m) {
  const Mesh mesh = unpackChunk(chunk, step_m);
  checkMesh(mesh);
  require(mesh.vertices_m.size() == chunk.vertexCount(), "all vertices are kept");
  require(mesh.triangles.size() == chunk.triangleCount(), "all triangles are kept");
  for (const Vec3f& n : mesh.normals) {
    require(std::abs(n.x * n.x + n.y * n.y + n.z * n.z - 1.0f) < 1e-5f, "unit normals");
  }
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    for (const MeshColour colour : {MeshColour::kAuto, MeshColour::kImage, MeshColour::kNormal,
                                    MeshColour::kHeight, MeshColour::kPlain}) {
      vertexColour(colour, mesh, i);
    }
  }
}

/// Checks that coarser levels of detail are valid chunks, with no more vertices or triangles.
void coarsenAndShow(const PackedChunk& chunk, double step_m) {
  for (int cell_log2 = 10; cell_log2 < 14; ++cell_log2) {
    const PackedChunk coarse = coarsen(chunk, cell_log2);
    checkChunk(coarse);
    require(coarse.vertexCount() <= chunk.vertexCount(), "no more vertices");
    require(coarse.triangleCount() <= chunk.triangleCount(), "no more triangles");
    require(coarse.colours.empty() == (chunk.colours.empty() || coarse.vertexCount() == 0),
            "colours if, and only if, the chunk is coloured");
    show(coarse, step_m * (1 << cell_log2) / 4);
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  InputBytes bytes(data, size);
  const auto step_m = bytes.take<double>();
  const PackedChunk chunk = takeChunk(bytes);
  bool is_sound = false;
  expectAnswer([&] {
    checkStep(step_m);
    checkChunk(chunk);
    is_sound = true;
  });
  if (!is_sound) return 0;
  show(chunk, step_m);
  coarsenAndShow(chunk, step_m);
  return 0;
}
