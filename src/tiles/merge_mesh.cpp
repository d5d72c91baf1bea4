#include "tiles/merge_mesh.h"

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <optional>
#include <queue>
#include <stdexcept>

#include "dtsdf_mapping/mesh.h"
#include "io/block_mesh_file.h"
#include "kernels/meshing/refine.h"
#include "meshing/block_joiner.h"
#include "meshing/mesh_origin.h"
#include "tiles/join_tables.h"

namespace dtsdf {
namespace {

/// Vertices are written so many at a time, at least.
constexpr size_t kVerticesAtOnce = 65536;

/// Joins blocks by rising keys, and keeps only the vertices that later blocks may share.
class MeshWindow {
 public:
  MeshWindow(const MeshedWhole& whole, const std::array<double, 3>& origin_m, PlyStream& ply)
      : positions_(whole.voxel_size_m), is_painted_(whole.painted), ply_(ply) {
    window_.origin_m = origin_m;
  }

  void add(const BlockMesh& block) {
    const JoinedBlock& joined = joiner_.add(block);
    for (const uint32_t i : joined.fresh) addVertex(block, i);
    for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
      const uint16_t* const corner = &block.triangles[t];
      const std::array<uint32_t, 3> triangle{joined.number[corner[0]], joined.number[corner[1]],
                                             joined.number[corner[2]]};
      ply_.addTriangle(triangle);
      addNormal(block, corner, inWindow(triangle), window_.normals);
    }
    // A vertex is listed by blocks side by side only: by none beyond the next one on each axis.
    open_.push_back({packKey(block.key + Vec3i{1, 1, 1}), end()});
    closeBefore(packKey(block.key));
  }

  void finish() {
    open_.clear();
    write(end());
  }

 private:
  struct OpenBlock {
    PackedKey last;    ///< That may list one of its vertices.
    uint64_t vertices; ///< Of all blocks up to this one.
  };

  uint64_t end() const { return written_ + window_.vertices_m.size(); }

  std::array<uint32_t, 3> inWindow(const std::array<uint32_t, 3>& triangle) const {
    std::array<uint32_t, 3> local;
    for (size_t i = 0; i < 3; ++i) {
      if (triangle[i] < written_) throw std::logic_error("a vertex was written too early");
      local[i] = static_cast<uint32_t>(triangle[i] - written_);
    }
    return local;
  }

  void addVertex(const BlockMesh& block, size_t i) {
    window_.vertices_m.push_back(
        positionFrom(window_.origin_m, positions_.positionInMap(block.key, block.vertices[i])));
    window_.normals.push_back({0.0f, 0.0f, 0.0f});
    // A tile that was never painted has none; in a map that was, these are not painted.
    if (is_painted_) {
      window_.colours.push_back(block.colours.empty() ? VertexColour{} : block.colours[i]);
    }
  }

  void closeBefore(PackedKey key) {
    for (; !open_.empty() && open_.front().last < key; open_.pop_front()) {
      closed_ = open_.front().vertices;
    }
    if (closed_ >= written_ + kVerticesAtOnce) write(closed_);
  }

  void write(uint64_t end_number) {
    const auto count = static_cast<std::ptrdiff_t>(end_number - written_);
    Mesh piece;
    piece.origin_m = window_.origin_m;
    piece.vertices_m.assign(window_.vertices_m.begin(), window_.vertices_m.begin() + count);
    piece.normals.assign(window_.normals.begin(), window_.normals.begin() + count);
    if (is_painted_) {
      piece.colours.assign(window_.colours.begin(), window_.colours.begin() + count);
      window_.colours.erase(window_.colours.begin(), window_.colours.begin() + count);
    }
    makeUnit(piece.normals);
    ply_.addVertices(piece);
    window_.vertices_m.erase(window_.vertices_m.begin(), window_.vertices_m.begin() + count);
    window_.normals.erase(window_.normals.begin(), window_.normals.begin() + count);
    written_ = end_number;
  }

  const MeshStore positions_;
  const bool is_painted_;
  PlyStream& ply_;
  BlockJoiner joiner_{true};
  Mesh window_;  ///< From vertex number written_ on.
  uint64_t written_ = 0, closed_ = 0;  ///< Up to which vertex; what is closed gets no more normals.
  std::deque<OpenBlock> open_;
};

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
  MeshWindow window(whole, originOf(bounds, whole.voxel_size_m), ply);
  while (!turns.empty()) {
    TileMeshes& tile = tiles[turns.top().second];
    const size_t number = turns.top().second;
    turns.pop();
    if (tile.isOpen()) window.add(tile.block());
    if (tile.advance()) turns.push({tile.key(), number});
  }
  window.finish();
}

}  // namespace dtsdf
