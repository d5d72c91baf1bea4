#include "meshing/mesh_chunks.h"

#include "kernels/meshing/corner_grid.h"

namespace dtsdf {

PackedKey MeshChunks::chunkOf(const BlockKey& block) const {
  return packKey({floorDivided(block.x, chunk_blocks_), floorDivided(block.y, chunk_blocks_),
                  floorDivided(block.z, chunk_blocks_)});
}

void MeshChunks::markChanged(const BlockKey& block) {
  const PackedKey chunk = chunkOf(block);
  ids_.emplace(chunk, static_cast<int>(ids_.size()));
  changed_.insert(chunk);
}

void MeshChunks::markAllChanged() {
  for (const auto& [chunk, id] : ids_) changed_.insert(chunk);
}

std::vector<PackedKey> MeshChunks::all() const {
  std::vector<PackedKey> chunks;
  for (const auto& [chunk, id] : ids_) chunks.push_back(chunk);
  return chunks;
}

BlockKey MeshChunks::cornerOf(PackedKey chunk) const {
  const BlockKey place = unpackKey(chunk);
  return {place.x * chunk_blocks_, place.y * chunk_blocks_, place.z * chunk_blocks_};
}

std::vector<PackedKey> MeshChunks::blocksOf(PackedKey chunk) const {
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

}  // namespace dtsdf
