/// Aligns depth images with a mesh, to separate errors of poses from errors of the mesh.
#pragma once

#include <vector>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"

namespace dtsdf {

/// The pose at which an image fits the mesh best, after `steps` Gauss-Newton steps on the distances
/// of measured points from the triangles that their rays hit. Pixels farther from the mesh than a
/// bound do not count, and those near the bound count little. The bound halves with each step, from
/// 20 % of the depth, or 0.4 m, to 5 %, or 0.1 m. The image does not move in directions that the
/// mesh does not constrain, as along a single wall, and keeps its pose if fewer than 50 points
/// count. The depth is row-major, in metres; 0: no depth.
Eigen::Isometry3d registerDepth(const MeshScene& scene, const ViewCamera& camera,
                                const std::vector<float>& depth_m, const Eigen::Isometry3d& T_W_C,
                                int steps);

}  // namespace dtsdf
