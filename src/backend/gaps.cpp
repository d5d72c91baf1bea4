#include "backend/gaps.h"

#include <algorithm>

#include "kernels/meshing/gap.h"

namespace dtsdf {
namespace {

constexpr uint16_t kUnused = 0xffff;

/// @return whether there was any.
bool dropMarked(std::vector<uint16_t>& triangles) {
  size_t kept = 0;
  for (size_t i = 0; i < triangles.size(); i += 3) {
    if (isMarkedGap(triangles.data() + i)) continue;
    if (kept != i) std::copy_n(triangles.begin() + i, 3, triangles.begin() + kept);
    kept += 3;
  }
  const bool any = kept < triangles.size();
  triangles.resize(kept);
  return any;
}

void dropUnusedVertices(BlockMesh& mesh) {
  std::vector<uint16_t> number(mesh.vertices.size(), kUnused);
  for (const uint16_t vertex : mesh.triangles) number[vertex] = 0;
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
