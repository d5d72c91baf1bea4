/// Writes .ply files with normals and colours, whole or piece by piece.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "dtsdf_mapping/mesh.h"
#include "io/little_endian.h"

namespace dtsdf {

/// @param far Whether the mesh is far from the origin, so that its positions are stored as doubles.
inline std::string plyHeader(size_t vertices, size_t triangles, bool far) {
  const std::string vertex_count = std::to_string(vertices);
  const std::string face_count = std::to_string(triangles);
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment metres, map frame\n";
  header += "element vertex " + vertex_count + "\n";
  const std::string position = far ? "double" : "float";
  for (const char* name : {"x", "y", "z"}) header += "property " + position + " " + name + "\n";
  for (const char* name : {"nx", "ny", "nz"}) {
    header += std::string("property float ") + name + "\n";
  }
  for (const char* name : {"red", "green", "blue"}) {
    header += std::string("property uchar ") + name + "\n";
  }
  header += "element face " + face_count + "\n";
  return header + "property list uchar int vertex_indices\nend_header\n";
}

/// Checks that a mesh is not empty and has fewer than 2^31 vertices and triangles.
/// @throws std::runtime_error that names the path and says what to do.
void checkMeshSize(uint64_t vertices, uint64_t triangles, const std::string& path);

/// @param file Has write(data, bytes).
template <class File>
void writePlyVertex(const Mesh& mesh, size_t vertex, MeshColour colour, File& file) {
  if (isFarFromOrigin(mesh)) {
    for (const double x_m : positionInMap(mesh, vertex)) put(file, x_m);
  } else {
    put(file, mesh.vertices_m[vertex]);
  }
  put(file, mesh.normals[vertex]);
  for (const uint8_t channel : vertexColour(colour, mesh, vertex)) put(file, channel);
}

template <class File>
void writePlyTriangle(const std::array<uint32_t, 3>& triangle, File& file) {
  put(file, uint8_t{3});
  for (const uint32_t index : triangle) put(file, index);
}

}  // namespace dtsdf
