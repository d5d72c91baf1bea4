/// Which chunks of blocks the mesh consists of, and which of them changed since they were sent.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// A chunk is a cube of blocks. Its id is given once and never to another chunk.
class MeshChunks {
 public:
  explicit MeshChunks(int chunk_blocks) : chunk_blocks_(chunk_blocks) {}

  /// The chunk of this block has changed.
  void markChanged(const BlockKey& block);
  void markAllChanged();

  const std::set<PackedKey>& changed() const { return changed_; }
  void forgetChanges() { changed_.clear(); }

  std::vector<PackedKey> all() const;
  int idOf(PackedKey chunk) const { return ids_.at(chunk); }

  /// The lowest block a chunk may have.
  BlockKey cornerOf(PackedKey chunk) const;

  /// The keys of all blocks a chunk may have, in canonical order.
  std::vector<PackedKey> blocksOf(PackedKey chunk) const;

 private:
  PackedKey chunkOf(const BlockKey& block) const;

  int chunk_blocks_;
  std::map<PackedKey, int> ids_;
  std::set<PackedKey> changed_;
};

}  // namespace dtsdf
