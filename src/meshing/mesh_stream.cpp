#include "meshing/mesh_stream.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "kernels/meshing/refine.h"

namespace dtsdf {
namespace {

/// An edge of the whole grid: the block that owns it and the edge's number in there.
struct GlobalEdge {
  PackedKey block;
  uint32_t edge;
};

/// The owner of an edge is the block of its lower corner: corners on a far face of the corner grid
/// belong to the neighbour.
GlobalEdge ownerOf(const BlockKey& key, uint32_t edge) {
  const Vec3i corner = cornerAt(edgeCorner(static_cast<int>(edge)));
  const Vec3i step{corner.x >> kBlockSideLog2, corner.y >> kBlockSideLog2,
                   corner.z >> kBlockSideLog2};
  constexpr int kMask = kBlockSide - 1;
  const int own = edgeNumber(cornerIndex(corner.x & kMask, corner.y & kMask, corner.z & kMask),
                             edgeAxis(static_cast<int>(edge)), edgeFacing(static_cast<int>(edge)));
  return {packKey(key + step), static_cast<uint32_t>(own)};
}

}  // namespace

const JoinedBlock& BlockJoiner::add(const BlockMesh& block) {
  const PackedKey key = packKey(block.key);
  // An edge is listed by its owner and by blocks below it, along each axis: none of them comes
  // once the owner is through.
  if (in_order_) shared_.erase(shared_.begin(), shared_.lower_bound(key));
  joined_.fresh.clear();
  joined_.number.resize(block.vertices.size());
  for (size_t i = 0; i < block.vertices.size(); ++i) {
    joined_.number[i] = numberOf(block, key, i);
    if (joined_.number[i] != next_) continue;
    joined_.fresh.push_back(static_cast<uint32_t>(i));
    ++next_;
  }
  return joined_;
}

/// The number of a block's vertex in the mesh; the next one if it is new.
uint32_t BlockJoiner::numberOf(const BlockMesh& block, PackedKey key, size_t i) {
  const uint32_t edge = block.vertices[i].edge;
  if (isMiddle(edge)) {
    const auto first = static_cast<uint32_t>(middleFirst(edge));
    const auto second = static_cast<uint32_t>(middleSecond(edge));
    const auto [low, high] = std::minmax(number_of_edge_[first], number_of_edge_[second]);
    const PackedKey last =
        std::min(ownerOf(block.key, first).block, ownerOf(block.key, second).block);
    // Also those that no other block lists: units side by side in this one both list them.
    return shared_[last].sides.emplace(GlobalSide{low, high}, next_).first->second;
  }
  const GlobalEdge owned = ownerOf(block.key, edge);
  number_of_edge_[edge] = numberOfEdge(owned.block, owned.edge, key);
  return number_of_edge_[edge];
}

/// Looks an edge up, and enters it, unless its owner is this block, which lists it once and last.
uint32_t BlockJoiner::numberOfEdge(PackedKey owner, uint32_t edge, PackedKey key) {
  if (owner != key || !in_order_) {
    return shared_[owner].edges.emplace(edge, next_).first->second;
  }
  const auto shared = shared_.find(key);
  if (shared == shared_.end()) return next_;
  const auto entry = shared->second.edges.find(edge);
  return entry == shared->second.edges.end() ? next_ : entry->second;
}

void addNormal(const BlockMesh& block, const uint16_t* corner, const std::array<uint32_t, 3>& t,
               std::vector<Vec3f>& normals) {
  const auto position = [&](int i) { return block.vertices[corner[i]].position; };
  const Vec3f n = cross(position(1) - position(0), position(2) - position(0));
  const auto faced = [&](int i) { return facedWays(block.vertices[corner[i]].edge); };
  const float turn = dot(n, toFloat(faced(0) + faced(1) + faced(2))) < 0.0f ? -1.0f : 1.0f;
  for (const uint32_t v : t) normals[v] = normals[v] + turn * n;
}

void makeUnit(std::vector<Vec3f>& normals) {
  for (Vec3f& n : normals) {
    const float length = norm(n);
    n = length > 0.0f ? (1.0f / length) * n : Vec3f{0.0f, 0.0f, 1.0f};
  }
}

namespace {

/// Vertices are handed out so many at a time, at least.
constexpr size_t kVerticesAtOnce = 65536;

}  // namespace

MeshStream::MeshStream(const Whole& whole, Sink sink)
    : positions_(whole.voxel_size_m), is_painted_(whole.is_painted), sink_(std::move(sink)) {
  window_.origin_m = originOf(whole.bounds, whole.voxel_size_m);
}

void MeshStream::add(const BlockMesh& block) {
  const JoinedBlock& joined = joiner_.add(block);
  for (const uint32_t i : joined.fresh) addVertex(block, i);
  for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
    const uint16_t* const corner = &block.triangles[t];
    const std::array<uint32_t, 3> triangle{joined.number[corner[0]], joined.number[corner[1]],
                                           joined.number[corner[2]]};
    sink_.triangle(triangle);
    addNormal(block, corner, inWindow(triangle), window_.normals);
  }
  // A vertex is listed by blocks side by side only: by none beyond the next one on each axis.
  open_.push_back({packKey(block.key + Vec3i{1, 1, 1}), end()});
  closeBefore(packKey(block.key));
}

void MeshStream::finish() {
  open_.clear();
  write(end());
}

std::array<uint32_t, 3> MeshStream::inWindow(const std::array<uint32_t, 3>& triangle) const {
  std::array<uint32_t, 3> local;
  for (size_t i = 0; i < 3; ++i) {
    if (triangle[i] < written_) throw std::logic_error("a vertex was written too early");
    local[i] = static_cast<uint32_t>(triangle[i] - written_);
  }
  return local;
}

void MeshStream::addVertex(const BlockMesh& block, size_t i) {
  window_.vertices_m.push_back(
      positionFrom(window_.origin_m, positions_.positionInMap(block.key, block.vertices[i])));
  window_.normals.push_back({0.0f, 0.0f, 0.0f});
  // A block that was meshed before anything was painted has none; in a map that is, these are not
  // painted.
  if (is_painted_) {
    window_.colours.push_back(block.colours.empty() ? VertexColour{} : block.colours[i]);
  }
}

void MeshStream::closeBefore(PackedKey key) {
  for (; !open_.empty() && open_.front().last < key; open_.pop_front()) {
    closed_ = open_.front().vertices;
  }
  if (closed_ >= written_ + kVerticesAtOnce) write(closed_);
}

void MeshStream::write(uint64_t end_number) {
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
  sink_.vertices(piece);
  window_.vertices_m.erase(window_.vertices_m.begin(), window_.vertices_m.begin() + count);
  window_.normals.erase(window_.normals.begin(), window_.normals.begin() + count);
  written_ = end_number;
}

}  // namespace dtsdf
