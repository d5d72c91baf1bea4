/// The bytes of a .ply file with normals and colours: one rule for meshes as a whole and in pieces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "dtsdf_mapping/mesh.h"
#include "io/little_endian.h"

namespace dtsdf {

/// `far`: positions are double, as a mesh far from the origin needs.
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

/// Whether there is a mesh, and one that the formats can hold.
/// @throws std::runtime_error that names the path and says what to do.
void checkMeshSize(uint64_t vertices, uint64_t triangles, const std::string& path);

/// `file` has write(data, bytes).
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

class PlySpool;

/// A .ply file of a mesh that comes piece by piece, for meshes that are larger than memory. The
/// bytes of saveMesh(). Vertices and triangles are kept in two files without names beside the
/// target until their numbers are known, which the format begins with.
class PlyStream {
 public:
  /// @throws std::runtime_error for a file that cannot be written, as all the others here.
  PlyStream(const std::string& path, MeshColour colour);
  ~PlyStream();

  /// The vertices of a piece, behind those before; all pieces have one origin. Its triangles are
  /// left alone.
  void addVertices(const Mesh& piece);

  /// By the numbers of vertices in the whole mesh.
  void addTriangle(const std::array<uint32_t, 3>& triangle);

  uint64_t vertices() const { return vertices_; }
  uint64_t triangles() const { return triangles_; }

  /// Gives the file its name. @throws std::runtime_error also for a mesh without triangles, or of
  /// more than the format holds.
  void finish();

 private:
  const std::string path_;
  const MeshColour colour_;
  const std::unique_ptr<PlySpool> vertex_bytes_, triangle_bytes_;
  uint64_t vertices_ = 0, triangles_ = 0;
  bool is_far_ = false;
};

}  // namespace dtsdf
