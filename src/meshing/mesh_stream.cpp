#include "meshing/mesh_stream.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "kernels/meshing/refine.h"

namespace dtsdf {
namespace {

constexpr uint16_t kInside = UINT16_MAX;  ///< Marks edges that only one block lists.

/// For both facings of each edge, CornerSource::block << 12 | CornerSource::voxel << 3 of its lower
/// corner.
std::array<uint16_t, kGridEdges / 2> edgeSources() {
  std::array<uint16_t, kGridEdges / 2> sources;
  for (int n = 0; n < kGridEdges / 2; ++n) {
    const CornerSource corner = cornerSource(n / 3);
    const Vec3i at = voxelOffset(corner.voxel) + unitStep(n % 3);  // never 0 along the edge
    const bool is_shared = at.x == 0 || at.y == 0 || at.z == 0;
    const int source = is_shared ? corner.block << 12 | corner.voxel << 3 : kInside;
    sources[n] = static_cast<uint16_t>(source);
  }
  return sources;
}

/// Facings of the edges from a corner: facingStep() of each edge whose index modulo 6 is the index.
constexpr Vec3f kFacings[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

/// Advances the tables for the current and the next row (or layer) by `steps` rows (or layers).
void advance(std::array<NumberTable, 2>& tables, int64_t steps) {
  if (steps == 0) return;
  std::swap(tables[0], tables[1]);
  if (steps != 1) tables[0].clear();
  tables[1].clear();
}

}  // namespace

const JoinedBlock& BlockJoiner::add(const BlockMesh& block) {
  const bool is_same_layer = block.key.z == last_.z;
  advance(rows_, is_same_layer ? int64_t{block.key.y} - last_.y : 2);
  advance(layers_, int64_t{block.key.z} - last_.z);
  inside_.clear();
  last_ = block.key;
  for (int n = 0; n < kCornerBlocks; ++n) {
    owners_[n] = packKey(block.key + cornerBlockOffset(n)) % kLayerStride;
  }
  joined_.fresh.clear();
  joined_.number.resize(block.vertices.size());
  joined_.faced.resize(block.vertices.size());
  for (size_t i = 0; i < block.vertices.size(); ++i) {
    const uint32_t edge = block.vertices[i].edge;
    joined_.faced[i] = isMidpoint(edge) ? toFloat(facingSteps(edge)) : kFacings[edge % 6];
    joined_.number[i] = numberOf(edge);
    if (joined_.number[i] != next_) continue;
    joined_.fresh.push_back(static_cast<uint32_t>(i));
    ++next_;
  }
  return joined_;
}

/// Index of a vertex in the joined mesh; next_ if the vertex is new. An edge is owned by the block
/// that contains its lower corner; corners on the upper faces of the block's grid belong to its
/// upper neighbours. Only the owner and its lower neighbours list the edge; neighbours in the layer
/// below list it only if it is on the lower face.
uint32_t BlockJoiner::numberOf(uint32_t edge) {
  static const std::array<uint16_t, kGridEdges / 2> sources = edgeSources();
  constexpr uint64_t kMidpoint = uint64_t{1} << 63;
  const auto tableOf = [this](uint16_t source) -> NumberTable& {
    const bool is_on_lower_face = (source >> 9 & 7) == 0;
    return is_on_lower_face ? layers_[source >> 14] : rows_[source >> 13 & 1];
  };
  if (isMidpoint(edge)) {
    const int first = midpointFirstEnd(edge), second = midpointSecondEnd(edge);
    const auto [low, high] = std::minmax(number_of_edge_[first], number_of_edge_[second]);
    const uint16_t source = sources[first / 2];
    const bool is_inside = source == kInside || sources[second / 2] == kInside;
    NumberTable& table = is_inside ? inside_ : tableOf(source);
    return table.findOrAdd(kMidpoint | uint64_t{low} << 32 | high, next_);
  }
  const uint16_t source = sources[edge / 2];
  if (source == kInside) return number_of_edge_[edge] = next_;
  const uint64_t name = owners_[source >> 12] << 12 | (source & 0xff8u) | edge % 6;
  return number_of_edge_[edge] = tableOf(source).findOrAdd(name, next_);
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

/// Removes each block from the front of a list if `key` comes after all blocks within `distance` of
/// that block along each axis, ignoring blocks beyond `last`. @return the number of vertices up to
/// the end of the last removed block; `before` if none was removed.
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
  PackedKey next = packKey(block.key);  // the first block that the previous step has not passed
  for (size_t i = 0; i < kSteps; ++i) {
    ahead_[i].emplace_back(block.key, end());
    passed_[i] = dropPassedBlocks(ahead_[i], kBlocksBehind[i], last_block_, next, passed_[i]);
    next = packKey(ahead_[i].front().first);  // this step has not passed its front block
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

/// Removes triangles from the front of a list, up to the first with a vertex that is not yet
/// written. Passes them, except crumbs, to `take`, with the output indices of their vertices.
template <class Take>
void MeshStream::takeWritten(Triangles& triangles, const Take& take) {
  size_t count = 0;
  for (; count < triangles.size(); ++count) {
    const auto& [a, b, c] = triangles[count];
    if (std::max({a, b, c}) >= done_[3]) break;
    if (isCrumb(outline_, triangles[count])) continue;
    take({numbers_[a - first_], numbers_[b - first_], numbers_[c - first_]});
  }
  dropFirst(triangles, count);
}

/// Advances each step up to the vertex given for it in `ends`.
void MeshStream::process(const std::array<uint32_t, kSteps>& ends) {
  outline_.link(done_[0], ends[0], triangles_);
  removeCrumbs(outline_, done_[1], ends[1], window_.vertices_m, positions_.voxelSize());
  closeHolesAndGaps(outline_, done_[2], ends[2], window_.vertices_m, window_.normals,
                    positions_.voxelSize(),
                    [this](const Outline::Triangle& t) { patches_.push_back(t); });
  write(done_[3], ends[3]);
  done_ = ends;
  takeWritten(triangles_, sink_.triangle);
  takeWritten(patches_, [this](const Outline::Triangle& t) { numbered_patches_.push_back(t); });
  uint32_t first = ends[4];
  for (const Outline::Triangle& t : patches_) first = std::min({first, t[0], t[1], t[2]});
  forget(first);
}

void MeshStream::write(uint32_t begin, uint32_t end) {
  Mesh piece;
  piece.origin_m = window_.origin_m;
  for (uint32_t i = begin; i < end; ++i) {
    if (outline_.isUnused(i)) continue;
    numbers_[i - first_] = next_number_++;
    piece.vertices_m.push_back(smoothed(outline_, i, window_.vertices_m));
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
