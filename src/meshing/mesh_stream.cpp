#include "meshing/mesh_stream.h"

#include <stdexcept>
#include <utility>

namespace dtsdf {
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
