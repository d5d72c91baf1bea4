/// Simplifies meshes: fewer triangles, within a given distance of the original.
#pragma once

#include <functional>
#include <stdexcept>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// A simplified mesh and its error.
struct SimplifiedMesh {
  Mesh mesh;             ///< Its vertices are a subset of the original's, unmoved.
  double error_m = 0.0;  ///< Largest distance of a vertex of the original from this mesh.
};

/// Called from time to time with the fraction of the work done. To cancel the work, throw an
/// exception.
using SimplifyProgress = std::function<void(double share)>;

/// Removes vertices while the surface stays within `max_error_m` of them; 0 removes none. A larger
/// error never leaves more triangles than a smaller one. The error is rounded down to 1, 1.5, 2, 3,
/// 5, 7 or 10 times a power of ten, and limited to 24 mean edges. Borders are kept. Facing
/// surfaces, such as the two sides of a thin plate or of a gap, stay apart: each stays in its half
/// of the space between them. Runs on one thread; the time grows with the number of triangles.
/// @throws std::invalid_argument unless max_error_m is finite, at least 0, and no more than the
/// diagonal of the mesh's bounding box; any exception that `progress` throws.
SimplifiedMesh simplifyMesh(const Mesh& mesh, double max_error_m,
                            const SimplifyProgress& progress = nullptr);

}  // namespace dtsdf
