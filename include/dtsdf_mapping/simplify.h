/// Meshes with fewer triangles, no farther than asked from the whole one.
#pragma once

#include <functional>
#include <stdexcept>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// What simplifyMesh() made, and how far it is off.
struct SimplifiedMesh {
  Mesh mesh;             ///< Its vertices are some of those of the whole mesh, as they were there.
  double error_m = 0.0;  ///< The largest distance of a vertex of the whole mesh from this one.
};

/// Called now and then with the share of the work that is done; false cancels it.
using SimplifyProgress = std::function<bool(double share)>;

/// Thrown where it was cancelled.
class SimplifyCancelled : public std::runtime_error {
 public:
  SimplifyCancelled() : std::runtime_error("cancelled before the mesh was simplified") {}
};

/// Removes vertices as long as the surface stays within `max_error_m` of where they were; 0 removes
/// none. A larger error leaves no more triangles than a smaller one. It counts in steps of 1, 1.5,
/// 2, 3, 5, 7 and 10, down to the nearest. Borders stay as they are. Sides that face each other, as
/// those of a thin plate or of a gap, stay apart: each keeps to its half of what is between them.
/// On one core, in a time that grows with the number of triangles.
/// @throws std::invalid_argument unless max_error_m is finite, at least 0, and no more than the
/// diagonal of the mesh's box; SimplifyCancelled.
SimplifiedMesh simplifyMesh(const Mesh& mesh, double max_error_m,
                            const SimplifyProgress& go_on = nullptr);

}  // namespace dtsdf
