#include "meshing/mesh_stream.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "kernels/meshing/refine.h"

namespace dtsdf {
namespace {

constexpr uint32_t kNone = UINT32_MAX;

/// The owner of an edge of a block's corner grid, and the edge's place in it. The owner is the
/// block of the edge's lower corner: corners on the grid's far faces belong to upper neighbours.
struct OwnedEdge {
  uint8_t owner;   ///< See cornerBlockOffset().
  uint16_t place;  ///< Index among the edges on the owner's lower faces; kInside if on none.
};

/// Marks an edge that is on none of its owner's lower faces: only the owner lists it.
constexpr uint16_t kInside = UINT16_MAX;
constexpr int kFaceCorners = kBlockSide * kBlockSide, kSharedPlaces = 3 * kFaceCorners * 6;

OwnedEdge ownedEdge(int edge) {
  const CornerSource source = cornerSource(edgeCorner(edge));
  const Vec3i at = voxelOffset(source.voxel);
  const auto place = [&](int face, int u, int v) {
    const int corner = face * kFaceCorners + u + kBlockSide * v;
    return static_cast<uint16_t>(edgeNumber(corner, edgeAxis(edge), edgeFacing(edge)));
  };
  const auto owner = static_cast<uint8_t>(source.block);
  if (at.x == 0) return {owner, place(0, at.y, at.z)};
  if (at.y == 0) return {owner, place(1, at.x, at.z)};
  if (at.z == 0) return {owner, place(2, at.x, at.y)};
  return {owner, kInside};
}

/// The owners of all edges of the corner grid.
const std::array<OwnedEdge, kGridEdges>& ownedEdges() {
  static const std::array<OwnedEdge, kGridEdges> edges = [] {
    std::array<OwnedEdge, kGridEdges> all;
    for (int edge = 0; edge < kGridEdges; ++edge) all[edge] = ownedEdge(edge);
    return all;
  }();
  return edges;
}

}  // namespace

BlockJoiner::BlockJoiner() {
  for (Owner& owner : owners_) owner.number.resize(kSharedPlaces, kNone);
}

const JoinedBlock& BlockJoiner::add(const BlockMesh& block) {
  // Only an edge's owner and the owner's lower neighbours list the edge, so no later block does.
  const PackedKey key = packKey(block.key);
  shared_edges_.erase(shared_edges_.begin(), shared_edges_.lower_bound(key));
  shared_sides_.erase(shared_sides_.begin(), shared_sides_.lower_bound(key));
  open(block.key);
  joined_.fresh.clear();
  joined_.number.resize(block.vertices.size());
  joined_.faced.resize(block.vertices.size());
  for (size_t i = 0; i < block.vertices.size(); ++i) {
    const uint32_t edge = block.vertices[i].edge;
    joined_.faced[i] = toFloat(facingSteps(edge));
    joined_.number[i] = numberOf(block, edge);
    if (joined_.number[i] != next_) continue;
    joined_.fresh.push_back(static_cast<uint32_t>(i));
    ++next_;
  }
  close(block.key);
  return joined_;
}

/// Sets the numbers that earlier blocks gave to edges that this block may list.
void BlockJoiner::open(const BlockKey& block) {
  for (int n = 0; n < kCornerBlocks; ++n) {
    Owner& owner = owners_[n];
    const auto shared = shared_edges_.find(packKey(block + cornerBlockOffset(n)));
    if (shared != shared_edges_.end()) owner.known = shared->second;
    owner.entered = owner.known.size();
    for (const auto& [place, number] : owner.known) owner.number[place] = number;
  }
}

/// Saves edges that this block was the first to list. No later block lists its own edges (n = 0).
void BlockJoiner::close(const BlockKey& block) {
  for (int n = 0; n < kCornerBlocks; ++n) {
    Owner& owner = owners_[n];
    for (const auto& [place, number] : owner.known) owner.number[place] = kNone;
    if (owner.known.size() > owner.entered && n != 0) {
      shared_edges_[packKey(block + cornerBlockOffset(n))] = owner.known;
    }
    owner.known.clear();
  }
}

/// The number of a block's vertex in the joined mesh; next_ if it is new.
uint32_t BlockJoiner::numberOf(const BlockMesh& block, uint32_t edge) {
  if (!isMidpoint(edge)) return number_of_edge_[edge] = numberOfEdge(edge);
  const int first = midpointFirstEnd(edge), second = midpointSecondEnd(edge);
  const auto [low, high] = std::minmax(number_of_edge_[first], number_of_edge_[second]);
  const auto ownerOf = [&](int end) {
    return packKey(block.key + cornerBlockOffset(ownedEdges()[end].owner));
  };
  const PackedKey last = std::min(ownerOf(first), ownerOf(second));
  // Midpoints inside the block are included, as both units that share the side list them.
  return shared_sides_[last].emplace(uint64_t{low} << 32 | high, next_).first->second;
}

uint32_t BlockJoiner::numberOfEdge(uint32_t edge) {
  const auto [block, place] = ownedEdges()[edge];
  if (place == kInside) return next_;
  Owner& owner = owners_[block];
  uint32_t& number = owner.number[place];
  if (number == kNone) {
    number = next_;
    owner.known.emplace_back(place, next_);
  }
  return number;
}

Outline::Kind outlineKind(const BlockVertex& vertex) {
  return isMidpoint(vertex.edge) ? Outline::Kind::kMiddle : Outline::Kind::kPlain;
}

void makeUnit(std::vector<Vec3f>& normals) {
  for (Vec3f& n : normals) {
    const float length = norm(n);
    n = length > 0.0f ? (1.0f / length) * n : Vec3f{0.0f, 0.0f, 1.0f};
  }
}

namespace {

/// Vertices are output and dropped at least this many at a time.
constexpr size_t kVerticesAtOnce = 65536;

/// Removes blocks from the front of a list while the block `distance` farther along each axis still
/// comes before `key`. @return the number of vertices up to the end of the last removed block;
/// `before` if there is none.
template <class Blocks>
uint64_t dropPassedBlocks(Blocks& blocks, int32_t distance, PackedKey key, uint64_t before) {
  const Vec3i beyond{distance, distance, distance};
  for (; !blocks.empty() && packKey(blocks.front().key + beyond) < key; blocks.pop_front()) {
    before = blocks.front().end;
  }
  return before;
}

template <class T>
void dropFirst(std::vector<T>& values, size_t count) {
  values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
}

template <class T>
std::vector<T> part(const std::vector<T>& values, size_t first, size_t count) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace

MeshStream::MeshStream(float voxel_size_m, bool is_painted, const BlockExtent& bounds, Sink sink)
    : positions_(voxel_size_m), is_painted_(is_painted), sink_(std::move(sink)) {
  window_.origin_m = originOf(bounds, voxel_size_m);
}

void MeshStream::add(const BlockMesh& block) {
  const JoinedBlock& joined = joiner_.add(block);
  for (const uint32_t i : joined.fresh) addVertex(block, i);
  for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
    const uint16_t* const corner = &block.triangles[t];
    const std::array<uint32_t, 3> triangle{joined.number[corner[0]], joined.number[corner[1]],
                                           joined.number[corner[2]]};
    sink_.triangle(triangle);
    const std::array<uint32_t, 3> local = inWindow(triangle);
    addNormal(block, joined, corner, local, window_.normals);
    outline_.addTriangle(local);
  }
  open_.push_back({block.key, end()});
  needed_.push_back({block.key, end()});
  // Only adjacent blocks, at most one step apart on each axis, list the same vertex. Outlines are
  // followed from vertices that are not yet written into adjacent blocks.
  const PackedKey key = packKey(block.key);
  closed_ = dropPassedBlocks(open_, 1, key, closed_);
  if (closed_ < written_ + kVerticesAtOnce) return;
  write(closed_);
  forget(dropPassedBlocks(needed_, 2, key, first_));
}

void MeshStream::finish() {
  write(end());
  for (const Outline::Triangle& triangle : closing_) sink_.triangle(triangle);
}

std::array<uint32_t, 3> MeshStream::inWindow(const std::array<uint32_t, 3>& triangle) const {
  std::array<uint32_t, 3> local;
  for (size_t i = 0; i < 3; ++i) {
    if (triangle[i] < written_) throw std::logic_error("a vertex was written too early");
    local[i] = static_cast<uint32_t>(triangle[i] - first_);
  }
  return local;
}

void MeshStream::addVertex(const BlockMesh& block, size_t i) {
  window_.vertices_m.push_back(
      positionFrom(window_.origin_m, positions_.positionInMap(block.key, block.vertices[i])));
  window_.normals.push_back({0.0f, 0.0f, 0.0f});
  outline_.addVertex(outlineKind(block.vertices[i]));
  // A block that was meshed before the map was first painted has no colours.
  if (is_painted_) {
    window_.colours.push_back(block.colours.empty() ? VertexColour{} : block.colours[i]);
  }
}

void MeshStream::write(uint64_t end_number) {
  const auto begin = static_cast<size_t>(written_ - first_);
  const auto count = static_cast<size_t>(end_number - written_);
  Mesh piece;
  piece.origin_m = window_.origin_m;
  outline_.closeHoles(begin, begin + count, window_.vertices_m, window_.normals,
                      [this](const Outline::Triangle& t) {
                        const auto number = [&](uint32_t i) {
                          return static_cast<uint32_t>(first_ + i);
                        };
                        closing_.push_back({number(t[0]), number(t[1]), number(t[2])});
                      });
  piece.vertices_m.reserve(count);
  for (size_t i = begin; i < begin + count; ++i) {
    piece.vertices_m.push_back(outline_.smoothed(i, window_.vertices_m));
  }
  piece.normals = part(window_.normals, begin, count);
  makeUnit(piece.normals);
  if (is_painted_) piece.colours = part(window_.colours, begin, count);
  sink_.vertices(piece);
  written_ = end_number;
}

void MeshStream::forget(uint64_t end_number) {
  const auto count = static_cast<size_t>(end_number - first_);
  dropFirst(window_.vertices_m, count);
  dropFirst(window_.normals, count);
  if (is_painted_) dropFirst(window_.colours, count);
  outline_.drop(count);
  first_ = end_number;
}

}  // namespace dtsdf
