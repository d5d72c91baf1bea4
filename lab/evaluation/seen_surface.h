/// The part of a mesh that images show, in small pieces.
#pragma once

#include "evaluation/camera_views.h"
#include "evaluation/triangle_mesh.h"

namespace dtsdf {

struct SeenSurfaceOptions {
  float longest_side_m = 0.02f;  ///< Triangles are cut until no side is longer.
  float max_depth_m = 10.0f;     ///< What is seen from farther away does not count.
  float least_cosine = 0.05f;    ///< Nor what is seen flatter than that, as cosine to the normal.
};

/// Cuts triangles at the middle of their longest side until none is longer. Each piece has corners
/// of its own.
TriangleMesh cutFinely(const TriangleMesh& mesh, float longest_side_m);

/// The pieces that some view shows: the middle of a pixel falls on it, which is one of two by two
/// that show the same surface. A single pixel, or a line of them, measures points, but does not
/// show how a surface runs through them, nor whether it is one or an edge that they mix.
/// @throws std::runtime_error if there are none.
TriangleMesh seenSurface(const TriangleMesh& mesh, const Views& views,
                         const SeenSurfaceOptions& options);

}  // namespace dtsdf
