#include "backend/gaps.h"

#include <algorithm>

#include "kernels/meshing/gap.h"

namespace dtsdf {
namespace {

constexpr uint16_t kUnused = 0xffff;

/// Drops the marked triangles. @return whether any was dropped.
bool dropMarked(std::vector<uint16_t>& triangles) {
  const uint16_t* const end = triangles.data() + triangles.size();
  uint16_t* kept = triangles.data();
  while (kept != end && !isMarkedGap(kept)) kept += 3;
  if (kept == end) return false;
  for (const uint16_t* from = kept + 3; from != end; from += 3) {
    if (isMarkedGap(from)) continue;
    for (int corner = 0; corner < 3; ++corner) kept[corner] = from[corner];
    kept += 3;
  }
  triangles.resize(static_cast<size_t>(kept - triangles.data()));
  return true;
}

/// Drops vertices without triangles. Usually there are none, since triangles next to the gap use
/// them.
void dropUnusedVertices(BlockMesh& mesh) {
  std::vector<uint16_t> number(mesh.vertices.size(), kUnused);
  for (const uint16_t vertex : mesh.triangles) number[vertex] = 0;
  if (std::find(number.begin(), number.end(), kUnused) == number.end()) return;
  uint16_t kept = 0;
  for (size_t i = 0; i < number.size(); ++i) {
    if (number[i] == kUnused) continue;
    mesh.vertices[kept] = mesh.vertices[i];
    if (!mesh.colours.empty()) mesh.colours[kept] = mesh.colours[i];
    number[i] = kept++;
  }
  mesh.vertices.resize(kept);
  if (!mesh.colours.empty()) mesh.colours.resize(kept);
  for (uint16_t& vertex : mesh.triangles) vertex = number[vertex];
}

}  // namespace

void dropGaps(BlockMesh& mesh) {
  if (dropMarked(mesh.triangles)) dropUnusedVertices(mesh);
}

}  // namespace dtsdf
