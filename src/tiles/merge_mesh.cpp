#include "tiles/merge_mesh.h"

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <optional>
#include <queue>
#include <stdexcept>

#include "io/block_mesh_file.h"
#include "kernels/meshing/refine.h"
#include "meshing/mesh_stream.h"
#include "tiles/join_tables.h"

namespace dtsdf {
namespace {

bool isOnEdges(const BlockMesh& block) {
  return std::all_of(block.vertices.begin(), block.vertices.end(),
                     [](const BlockVertex& vertex) { return isVertexNumber(vertex.edge); });
}

/// The meshes of a tile, opened when their turn comes.
class TileMeshes {
 public:
  TileMeshes(const MeshOfTile& mesh, const std::string& folder) : mesh_(mesh), folder_(folder) {}

  /// Of the next block; before the file is opened, a bound of it.
  PackedKey key() const { return block_ ? packKey(block_->key) : mesh_.first; }
  bool isOpen() const { return reader_.has_value(); }
  const BlockMesh& block() const { return *block_; }

  /// Opens the file, or moves on in it. @return whether there is another block.
  bool advance() {
    try {
      if (!reader_) reader_.emplace(mesh_.path);
      block_ = reader_->next();
      if (block_ && !isOnEdges(*block_)) {
        throw std::runtime_error("its meshes are damaged (a vertex is on no edge of its block)");
      }
    } catch (const std::exception& error) {
      throwBadTile(folder_, mesh_.tile, error.what());
    }
    if (!block_ && reader_->checksum() != mesh_.checksum) {
      throwBadTile(folder_, mesh_.tile, "its meshes do not match its record");
    }
    return block_.has_value();
  }

 private:
  const MeshOfTile mesh_;
  const std::string folder_;
  std::optional<BlockMeshReader> reader_;
  std::optional<BlockMesh> block_;
};

}  // namespace

void mergeMeshes(const std::vector<MeshOfTile>& meshes, const std::string& folder,
                 const MeshedWhole& whole, PlyStream& ply) {
  std::deque<TileMeshes> tiles;
  using Turn = std::pair<PackedKey, size_t>;
  std::priority_queue<Turn, std::vector<Turn>, std::greater<Turn>> turns;
  BlockBounds bounds;
  for (const MeshOfTile& mesh : meshes) {
    turns.push({mesh.first, tiles.size()});
    tiles.emplace_back(mesh, folder);
    bounds.add(mesh.bounds);
  }
  MeshStream stream({whole.voxel_size_m, whole.painted, bounds},
                    {[&](const Mesh& piece) { ply.addVertices(piece); },
                     [&](const std::array<uint32_t, 3>& triangle) { ply.addTriangle(triangle); }});
  while (!turns.empty()) {
    TileMeshes& tile = tiles[turns.top().second];
    const size_t number = turns.top().second;
    turns.pop();
    if (tile.isOpen()) stream.add(tile.block());
    if (tile.advance()) turns.push({tile.key(), number});
  }
  stream.finish();
}

}  // namespace dtsdf
