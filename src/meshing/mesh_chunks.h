/// The chunks of a mesh, and which of them changed since the last forgetChanges().
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "kernels/meshing/corner_grid.h"

namespace dtsdf {

/// Chunks are cubes of blocks. Their ids are never reused.
class MeshChunks {
 public:
  explicit MeshChunks(int chunk_blocks) : chunk_blocks_(chunk_blocks) {}

  /// Marks the chunk that contains this block as changed.
  void markChanged(const BlockKey& block) {
    const PackedKey chunk = chunkOf(block);
    ids_.emplace(chunk, static_cast<int>(ids_.size()));
    changed_.insert(chunk);
  }

  void markAllChanged() {
    for (const auto& [chunk, id] : ids_) changed_.insert(chunk);
  }

  const std::set<PackedKey>& changed() const { return changed_; }
  void forgetChanges() { changed_.clear(); }

  std::vector<PackedKey> all() const {
    std::vector<PackedKey> chunks;
    for (const auto& [chunk, id] : ids_) chunks.push_back(chunk);
    return chunks;
  }

  /// The next `count` chunks, in round-robin order. New chunks do not restart the cycle.
  std::vector<PackedKey> nextRoundRobin(size_t count) {
    std::vector<PackedKey> chunks;
    for (size_t i = 0; i < std::min(count, ids_.size()); ++i) {
      auto next = ids_.upper_bound(last_returned_);
      if (next == ids_.end()) next = ids_.begin();
      last_returned_ = next->first;
      chunks.push_back(last_returned_);
    }
    return chunks;
  }

  int idOf(PackedKey chunk) const { return ids_.at(chunk); }

  /// The lowest block of a chunk, whether or not it has a mesh.
  BlockKey cornerOf(PackedKey chunk) const {
    const BlockKey place = unpackKey(chunk);
    return {place.x * chunk_blocks_, place.y * chunk_blocks_, place.z * chunk_blocks_};
  }

  /// Packed keys of all blocks that a chunk may contain, in canonical order.
  std::vector<PackedKey> blocksOf(PackedKey chunk) const {
    const BlockKey corner = cornerOf(chunk);
    std::vector<PackedKey> blocks;
    for (int z = 0; z < chunk_blocks_; ++z) {
      for (int y = 0; y < chunk_blocks_; ++y) {
        for (int x = 0; x < chunk_blocks_; ++x) {
          const BlockKey block{corner.x + x, corner.y + y, corner.z + z};
          if (isRepresentable(block)) blocks.push_back(packKey(block));
        }
      }
    }
    return blocks;
  }

 private:
  PackedKey chunkOf(const BlockKey& block) const {
    return packKey({floorDivided(block.x, chunk_blocks_), floorDivided(block.y, chunk_blocks_),
                    floorDivided(block.z, chunk_blocks_)});
  }

  int chunk_blocks_;
  std::map<PackedKey, int> ids_;
  std::set<PackedKey> changed_;
  PackedKey last_returned_ = 0;
};

}  // namespace dtsdf
