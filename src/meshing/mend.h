/// Mends a mesh at its outlines.
///
/// - A **crumb** is a piece of a few triangles near a larger piece, mostly noise. It is left out.
/// - A **hole** has a short outline, and is due to mesh units (marching cubes cells) without an
///   active direction (see docs/glossary.md). It is closed.
/// - A **gap** between outlines, or a notch in one, is filled with triangles where a ball that
///   rolls over the outlines comes to rest. Outlines then move inwards, so that the area
///   stays about the same.
/// - A mesh ends at whole units, so outlines have teeth one voxel high where images disagree about
///   the outermost units. Vertices are smoothed along the outlines with the weights (-1 4 10 4 -1)
///   / 16, which remove the teeth but keep straight and evenly curved lines.
///
/// mendMesh() does all of this. For a mesh in pieces, call Outline::link(), removeCrumbs(),
/// closeHolesAndGaps() and smoothed() in this order, each for any number of vertices at a time.
/// Each step depends on what the previous step did to vertices up to one block away, or up to two
/// blocks away for removeCrumbs() and closeHolesAndGaps(). A chain of gaps could reach farther, but
/// none was seen. Below, `positions` and `normals` start at Outline::first(), and `voxel` is the
/// edge of a voxel in units of `positions`.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "kernels/core/grid.h"
#include "meshing/outline.h"

namespace dtsdf {

/// The cell of a position in a grid of cubes.
inline Vec3i cellOf(const Vec3f& position, float side) {
  const Vec3f scaled = (1.0f / side) * position;
  return {floorToInt(scaled.x), floorToInt(scaled.y), floorToInt(scaled.z)};
}

/// Removes the crumbs whose first vertex on an outline is in [first, end).
void removeCrumbs(Outline& outline, uint32_t first, uint32_t end,
                  const std::vector<Vec3f>& positions, float voxel);

/// Whether a triangle belongs to a removed crumb.
inline bool isCrumb(const Outline& outline, const Outline::Triangle& t) {
  return outline.isUnused(t[0]) || outline.isUnused(t[1]) || outline.isUnused(t[2]);
}

/// Closes holes and fills gaps. Holes are loops of at most eight edges, not counting midpoints,
/// that can be filled with triangles facing the same way as their vertices. The outline of a small
/// piece therefore does not count as a hole. Adds the triangles whose lowest vertex is in [first,
/// end).
/// @param normals One per vertex, not necessarily of unit length. @param add Receives the new
/// triangles.
void closeHolesAndGaps(Outline& outline, uint32_t first, uint32_t end,
                       const std::vector<Vec3f>& positions, const std::vector<Vec3f>& normals,
                       float voxel, const std::function<void(const Outline::Triangle&)>& add);

/// Fills gaps with triangles by a ball that rolls over the outlines, and adds them to `patches`.
/// @param patches Must include the triangles that fill holes.
void fillGaps(const Outline& outline, const std::vector<Vec3f>& positions, float voxel,
              std::vector<Outline::Triangle>& patches);

/// The smoothed position of a vertex. @param positions One per vertex, before smoothing.
Vec3f smoothed(const Outline& outline, uint32_t vertex, const std::vector<Vec3f>& positions);

/// Drops the vertices for which `is_kept` is 0, and all triangles that use them.
void keepVertices(Mesh& mesh, const std::vector<uint8_t>& is_kept);

/// Mends a mesh whose vertices and triangles have been added to the outline. Its normals need not
/// be of unit length. Drops vertices without triangles.
void mendMesh(Mesh& mesh, Outline& outline, float voxel);

}  // namespace dtsdf
