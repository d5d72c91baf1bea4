#include "meshing/mend.h"

#include <algorithm>

#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

constexpr int kStepsAlong = 2;

/// A section of an outline whose ends are closer together than this fraction of its length is the
/// tip of something narrow, which smoothing would shorten.
constexpr float kMinExtent = 0.4f;

/// The next vertex on the outline that is not a midpoint (Outline::Kind::kMiddle).
uint32_t nextOnEdge(const Outline& outline, uint32_t vertex, size_t way) {
  const uint32_t next = outline.beside(vertex, way);
  const bool is_middle = next != Outline::kNone && outline.kind(next) == Outline::Kind::kMiddle;
  return is_middle ? outline.beside(next, way) : next;
}

/// The shift of a vertex that makes up for the new triangles on the outline beside it, so that the
/// surface about keeps its area.
Vec3f shiftForNotches(const Outline& outline, uint32_t vertex,
                      const std::vector<Vec3f>& positions) {
  const auto position = [&](uint32_t of) { return positions[of - outline.first()]; };
  Vec3f sum{0.0f, 0.0f, 0.0f};
  float length = 0.0f;
  for (const size_t way : {Outline::kForwards, Outline::kBackwards}) {
    const uint32_t end = outline.beside(vertex, way);
    if (end == Outline::kNone || end < outline.first()) return {0.0f, 0.0f, 0.0f};
    const Vec3f edge = position(end) - position(vertex);
    length += norm(edge);
    const Outline::Rim& rim = outline.rimOf(vertex);
    for (uint32_t n = rim.own; n < rim.links; ++n) {
      const Outline::Link& patch = outline.linksOf(rim)[n];
      if ((way == Outline::kForwards ? patch.next : patch.previous) != end) continue;
      const uint32_t bottom = way == Outline::kForwards ? patch.previous : patch.next;
      const Vec3f depth = position(bottom) - position(vertex);
      if (!(dot(edge, edge) > 0.0f)) continue;
      const float along = std::min(std::max(0.0f, dot(depth, edge) / dot(edge, edge)), 1.0f);
      const Vec3f inwards = depth - along * edge;
      sum = sum + 0.5f * norm(edge) * inwards;
    }
  }
  return length > 0.0f ? (1.0f / length) * sum : sum;
}

Vec3f shiftOf(const Outline& outline, uint32_t vertex, const std::vector<Vec3f>& positions) {
  constexpr size_t kWays[] = {Outline::kForwards, Outline::kBackwards};
  const auto position = [&](uint32_t of) { return positions[of - outline.first()]; };
  const Vec3f p = position(vertex);
  const Vec3f for_notches = shiftForNotches(outline, vertex, positions);
  Vec3f ends[2] = {p, p};
  uint32_t at[2] = {vertex, vertex};
  Vec3f from_vertex[kStepsAlong] = {};  // per step, summed over both ways
  float length = 0.0f;
  for (Vec3f& sum : from_vertex) {
    for (const size_t way : kWays) at[way] = nextOnEdge(outline, at[way], way);
    if (at[0] == Outline::kNone || at[1] == Outline::kNone) break;
    for (const size_t way : kWays) {
      length += norm(position(at[way]) - ends[way]);
      ends[way] = position(at[way]);
    }
    sum = (ends[0] - p) + (ends[1] - p);
  }
  if (norm(ends[0] - ends[1]) < kMinExtent * length) return for_notches;
  // These weights remove teeth whose sides are one edge long, and leave a parabola unchanged.
  return for_notches + 1.0f / 4.0f * from_vertex[0] + -1.0f / 16.0f * from_vertex[1];
}

}  // namespace

Vec3f smoothed(const Outline& outline, uint32_t vertex, const std::vector<Vec3f>& positions) {
  const Vec3f& position = positions[vertex - outline.first()];
  const uint32_t ends[2] = {outline.beside(vertex, Outline::kForwards),
                            outline.beside(vertex, Outline::kBackwards)};
  if (ends[0] == Outline::kNone || ends[1] == Outline::kNone) return position;
  if (outline.kind(vertex) == Outline::Kind::kPlain) {
    return position + shiftOf(outline, vertex, positions);
  }
  return position +
         0.5f * (shiftOf(outline, ends[0], positions) + shiftOf(outline, ends[1], positions));
}

void keepVertices(Mesh& mesh, const std::vector<uint8_t>& is_kept) {
  std::vector<uint32_t> number(is_kept.size());
  uint32_t count = 0;
  for (size_t i = 0; i < is_kept.size(); ++i) {
    number[i] = count;
    if (is_kept[i] == 0) continue;
    mesh.vertices_m[count] = mesh.vertices_m[i];
    mesh.normals[count] = mesh.normals[i];
    if (!mesh.colours.empty()) mesh.colours[count] = mesh.colours[i];
    ++count;
  }
  if (count == is_kept.size()) return;
  mesh.vertices_m.resize(count);
  mesh.normals.resize(count);
  if (!mesh.colours.empty()) mesh.colours.resize(count);
  size_t kept = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    if ((is_kept[a] & is_kept[b] & is_kept[c]) == 0) continue;
    mesh.triangles[kept++] = {number[a], number[b], number[c]};
  }
  mesh.triangles.resize(kept);
}

void mendMesh(Mesh& mesh, Outline& outline, float voxel) {
  const auto count = static_cast<uint32_t>(mesh.vertices_m.size());
  outline.link(0, count, mesh.triangles);
  removeCrumbs(outline, 0, count, mesh.vertices_m, voxel);
  closeHolesAndGaps(outline, 0, count, mesh.vertices_m, mesh.normals, voxel,
                    [&](const Outline::Triangle& triangle) { mesh.triangles.push_back(triangle); });
  std::vector<Vec3f> moved;
  moved.reserve(outline.rims().size());
  for (const Outline::Rim& rim : outline.rims()) {
    moved.push_back(smoothed(outline, rim.vertex, mesh.vertices_m));
  }
  for (size_t n = 0; n < moved.size(); ++n) mesh.vertices_m[outline.rims()[n].vertex] = moved[n];
  std::vector<uint8_t> is_kept(count);
  for (uint32_t i = 0; i < count; ++i) is_kept[i] = outline.isUnused(i) ? 0 : 1;
  keepVertices(mesh, is_kept);
}

}  // namespace dtsdf
