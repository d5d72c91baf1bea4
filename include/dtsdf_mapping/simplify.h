/// Meshes with fewer triangles, no farther than asked from the whole one.
#pragma once

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// What simplifyMesh() made, and how far it is off.
struct SimplifiedMesh {
  Mesh mesh;             ///< Its vertices are some of those of the whole mesh, as they were there.
  double error_m = 0.0;  ///< The largest distance of a vertex of the whole mesh from this one.
};

/// Whether this build can simplify: it takes the library meshoptimizer.
bool canSimplify();

/// Leaves out vertices where a surface goes on without them no farther than `max_error_m` from
/// where they were; that is measured, and where it does not hold, fewer are left out. Borders stay
/// as they are. Sides that face each other, as those of a thin plate or of a gap, stay apart: each
/// keeps to its half of what is between them.
/// @throws std::invalid_argument unless max_error_m is finite and above 0; std::runtime_error
/// where canSimplify() is false, with what to do.
SimplifiedMesh simplifyMesh(const Mesh& mesh, double max_error_m);

}  // namespace dtsdf
