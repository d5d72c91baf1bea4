/// Moves a mesh, all by one motion, to where it lies best on the true one: a map's frame comes from
/// its first pose, and trajectories alone leave it turned about the way that they go.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "evaluation/mesh_scene.h"

namespace dtsdf {

struct MeshRegistration {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  double shift_m = 0.0;  ///< Of the mesh's middle.
  double turn_rad = 0.0;
  size_t points = 0;  ///< Samples that counted in the last step; 0: too few, it is not moved.
};

/// So many steps of Gauss and Newton on the distances of samples of the mesh from the planes of the
/// nearest triangles. What is farther off than a bound does not count: it falls from 0.4 m to 50 mm
/// within a dozen steps.
MeshRegistration registerMesh(const MeshScene& truth, const TriangleMesh& mesh, int steps);

/// Moves the vertices.
void move(TriangleMesh& mesh, const Eigen::Isometry3d& motion);

}  // namespace dtsdf
