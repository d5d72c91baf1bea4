/// A .ply file of a mesh that comes piece by piece, for meshes that are larger than memory.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// The bytes of saveMesh(). Vertices and triangles are kept in two files without names beside the
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

  uint64_t vertices() const;
  uint64_t triangles() const;

  /// Gives the file its name. @throws std::runtime_error also for a mesh without triangles, or of
  /// more than the format holds.
  void finish();

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace dtsdf
