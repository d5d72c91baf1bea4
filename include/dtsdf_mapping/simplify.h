/// Simplifies meshes: reduces the number of triangles while staying within a given distance of the
/// original.
#pragma once

#include <functional>
#include <stdexcept>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// A simplified mesh and its error.
struct SimplifiedMesh {
  Mesh mesh;  ///< The remaining vertices, at their original positions, and new triangles.
  /// Maximum distance between a vertex of the original and this mesh, in metres.
  double error_m = 0.0;
};

/// Called from time to time with the fraction of the work done. Throw an exception to cancel the
/// work.
using SimplifyProgress = std::function<void(double share)>;

/// Removes vertices as long as the surface stays within `max_error_m` of them; 0 removes none. A
/// larger limit never leaves more triangles than a smaller one. The limit is rounded down to 1,
/// 1.5, 2, 3, 5, 7 or 10 times a power of ten, and limited to 24 times the mean edge length.
/// Borders are kept. Opposite surfaces, such as the two sides of a thin plate or of a gap, stay
/// apart: neither crosses the middle between them. Runs on one thread; the time grows with the
/// number of triangles.
/// @throws std::invalid_argument unless max_error_m is finite, at least 0, and no more than the
/// diagonal of the mesh's bounding box; any exception thrown by `progress`.
SimplifiedMesh simplifyMesh(const Mesh& mesh, double max_error_m,
                            const SimplifyProgress& progress = nullptr);

}  // namespace dtsdf
