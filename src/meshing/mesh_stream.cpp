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

/// Removes blocks from the front of a list while all within `distance` along each axis, up to the
/// block `last`, come before `key`. @return the number of vertices up to the end of the last
/// removed block; `before` if there is none.
template <class Blocks>
uint32_t dropPassedBlocks(Blocks& blocks, int32_t distance, const Vec3i& last, PackedKey key,
                          uint32_t before) {
  const Vec3i beyond{distance, distance, distance};
  const auto farthest = [&] { return packKey(minOf(blocks.front().first + beyond, last)); };
  for (; !blocks.empty() && farthest() < key; blocks.pop_front()) {
    before = blocks.front().second;
  }
  return before;
}

template <class T>
void dropFirst(std::vector<T>& values, size_t count) {
  values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

MeshStream::MeshStream(float voxel_size_m, bool is_painted, const BlockExtent& bounds, Sink sink,
                       uint32_t vertices_at_once)
    : positions_(voxel_size_m),
      is_painted_(is_painted),
      last_block_(bounds.last),
      sink_(std::move(sink)),
      vertices_at_once_(vertices_at_once) {
  window_.origin_m = originOf(bounds, voxel_size_m);
}

void MeshStream::add(const BlockMesh& block) {
  const JoinedBlock& joined = joiner_.add(block);
  for (const uint32_t i : joined.fresh) addVertex(block, i);
  for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
    const uint16_t* const corner = &block.triangles[t];
    Outline::Triangle triangle, in_window;
    for (size_t k = 0; k < 3; ++k) {
      triangle[k] = joined.number[corner[k]];
      in_window[k] = triangle[k] - first_;
      if (triangle[k] < done_[0]) throw std::logic_error("a vertex was processed too early");
    }
    addNormal(block, joined, corner, in_window, window_.normals);
    outline_.addTriangle(triangle);
    triangles_.push_back(triangle);
  }
  for (size_t i = 0; i < kSteps; ++i) {
    ahead_[i].emplace_back(block.key, end());
    passed_[i] =
        dropPassedBlocks(ahead_[i], kBlocksBehind[i], last_block_, packKey(block.key), passed_[i]);
  }
  if (passed_[0] - done_[0] < std::max(vertices_at_once_, (end() - first_) / 4)) return;
  process(passed_);
}

void MeshStream::finish() {
  std::array<uint32_t, kSteps> ends;
  ends.fill(end());
  process(ends);
  for (const Outline::Triangle& triangle : numbered_patches_) sink_.triangle(triangle);
}

void MeshStream::addVertex(const BlockMesh& block, size_t i) {
  window_.vertices_m.push_back(
      positionFrom(window_.origin_m, positions_.positionInMap(block.key, block.vertices[i])));
  window_.normals.push_back({0.0f, 0.0f, 0.0f});
  numbers_.push_back(0);
  outline_.addVertex(outlineKind(block.vertices[i]));
  // A block that was meshed before the map was first painted has no colours.
  if (is_painted_) {
    window_.colours.push_back(block.colours.empty() ? VertexColour{} : block.colours[i]);
  }
}

/// Takes the triangles whose vertices have been written off a list, with their numbers in the
/// output.
template <class Take>
void MeshStream::takeWritten(Triangles& triangles, const Take& take) {
  size_t count = 0;
  for (; count < triangles.size(); ++count) {
    const auto& [a, b, c] = triangles[count];
    if (std::max({a, b, c}) >= done_[3]) break;
    if (outline_.isCrumb(triangles[count])) continue;
    take({numbers_[a - first_], numbers_[b - first_], numbers_[c - first_]});
  }
  dropFirst(triangles, count);
}

/// Continues each step up to this vertex.
void MeshStream::process(const std::array<uint32_t, kSteps>& ends) {
  outline_.link(done_[0], ends[0], triangles_);
  outline_.removeCrumbs(done_[1], ends[1], window_.vertices_m, positions_.voxelSize());
  outline_.close(done_[2], ends[2], window_.vertices_m, window_.normals, positions_.voxelSize(),
                 [this](const Outline::Triangle& t) { patches_.push_back(t); });
  write(done_[3], ends[3]);
  done_ = ends;
  takeWritten(triangles_, sink_.triangle);
  takeWritten(patches_, [this](const Outline::Triangle& t) { numbered_patches_.push_back(t); });
  forget(ends[4]);
}

void MeshStream::write(uint32_t begin, uint32_t end) {
  Mesh piece;
  piece.origin_m = window_.origin_m;
  for (uint32_t i = begin; i < end; ++i) {
    if (outline_.isUnused(i)) continue;
    numbers_[i - first_] = next_number_++;
    piece.vertices_m.push_back(outline_.smoothed(i, window_.vertices_m));
    piece.normals.push_back(window_.normals[i - first_]);
    if (is_painted_) piece.colours.push_back(window_.colours[i - first_]);
  }
  makeUnit(piece.normals);
  sink_.vertices(piece);
}

void MeshStream::forget(uint32_t first) {
  const size_t count = first - first_;
  dropFirst(window_.vertices_m, count);
  dropFirst(window_.normals, count);
  if (is_painted_) dropFirst(window_.colours, count);
  dropFirst(numbers_, count);
  outline_.forget(first);
  first_ = first;
}

}  // namespace dtsdf
