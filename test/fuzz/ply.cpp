// Meshes that are compared: PLY of any kind.
#include "evaluation/triangle_mesh.h"
#include "fuzz/fuzz_input.h"

using namespace dtsdf;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const InputFile file(data, size);
  expectAnswer([&] {
    const TriangleMesh mesh = readPly(file.path());
    for (const auto& vertex : mesh.vertices) require(vertex.allFinite(), "finite vertices");
    for (const auto& triangle : mesh.triangles) {
      for (const uint32_t index : triangle) require(index < mesh.vertices.size(), "an index");
    }
    require(mesh.colours.empty() || mesh.colours.size() == mesh.vertices.size(), "colours");
  });
  return 0;
}
