/// Meshes of blocks in a file, to be joined with those of other files: what a tile hands on.
///
/// "DTSDFMSH", a uint32 for the version, a uint32 of 0, and three uint64: blocks, vertices and
/// triangles; then each block, by packed key: its key, three uint32 for its vertices, indices and
/// colours, and these; at the end a uint64, the checksum (XXH64) of all before. Little endian.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "dtsdf_mapping/block_mesh.h"

namespace dtsdf {

/// How much a file holds.
struct BlockMeshCounts {
  uint64_t blocks = 0, vertices = 0, triangles = 0;
};

/// Calls `take` with meshes whose blocks rise by packed key.
using BlockMeshVisit = std::function<void(const std::function<void(const BlockMesh&)>& take)>;

/// Writes meshes one by one, which are visited twice; the file is whole or not there.
/// @return its checksum. @throws std::runtime_error as AtomicFile
uint64_t saveBlockMeshes(const BlockMeshVisit& visit, const std::string& path);

/// Hands out the meshes of a file one by one.
class BlockMeshReader {
 public:
  /// @throws std::runtime_error with one sentence for what is no such file.
  explicit BlockMeshReader(const std::string& path);
  ~BlockMeshReader();
  BlockMeshReader(BlockMeshReader&&) noexcept;

  const BlockMeshCounts& counts() const;

  /// The next block, or nothing at the end, where the checksum is compared.
  /// @throws std::runtime_error for a damaged file
  std::optional<BlockMesh> next();

  /// Of what next() has read, once it was at the end.
  uint64_t checksum() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dtsdf
