/// Joins the meshes of blocks into one that is handed out piece by piece: it need not fit into
/// memory.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>

#include "dtsdf_mapping/mesh.h"
#include "meshing/block_joiner.h"
#include "meshing/mesh_origin.h"

namespace dtsdf {

/// Takes blocks by rising keys, and keeps only the vertices that later blocks may share. What it
/// hands out is what MeshStore::assemble() returns of all of them, in the same order.
class MeshStream {
 public:
  /// Whoever takes the mesh.
  struct Sink {
    std::function<void(const Mesh& piece)> vertices;  ///< Behind those before; no triangles.
    /// By the numbers of vertices in the whole mesh; some come before their vertices do.
    std::function<void(const std::array<uint32_t, 3>&)> triangle;
  };

  /// What is known of the mesh before it comes.
  struct Whole {
    float voxel_size_m;
    bool is_painted;     ///< Some of the blocks have colours.
    BlockBounds bounds;  ///< Of the blocks.
  };

  MeshStream(const Whole& whole, Sink sink);

  void add(const BlockMesh& block);

  /// Hands out what is left.
  void finish();

 private:
  struct OpenBlock {
    PackedKey last;     ///< That may list one of its vertices.
    uint64_t vertices;  ///< Of all blocks up to this one.
  };

  uint64_t end() const { return written_ + window_.vertices_m.size(); }
  std::array<uint32_t, 3> inWindow(const std::array<uint32_t, 3>& triangle) const;
  void addVertex(const BlockMesh& block, size_t i);
  void closeBefore(PackedKey key);
  void write(uint64_t end_number);

  const MeshStore positions_;
  const bool is_painted_;
  const Sink sink_;
  BlockJoiner joiner_{true};
  Mesh window_;                        ///< From vertex number written_ on.
  uint64_t written_ = 0, closed_ = 0;  ///< Up to which vertex; what is closed is as it stays.
  std::deque<OpenBlock> open_;
};

}  // namespace dtsdf
