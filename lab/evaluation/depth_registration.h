/// Aligns depth images with a mesh, to separate errors in the poses from errors in the mesh.
#pragma once

#include <vector>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"

namespace dtsdf {

/// The pose at which an image fits the mesh best, after `steps` Gauss-Newton steps on the distances
/// of measured points from the planes of the triangles that their rays hit. Pixels whose depth is
/// off by more than a bound are ignored, and pixels near the bound get little weight. The bound is
/// 20 % of the depth, at most 0.4 m, in the first step, half of that in the second, and a quarter
/// of it in all later steps. The image does not move in directions that the mesh does not
/// constrain, such as along a single wall. If fewer than 50 points count in any step, `T_W_C` is
/// returned. The depth is row-major, in metres; 0: no depth.
Eigen::Isometry3d registerDepth(const MeshScene& scene, const ViewCamera& camera,
                                const std::vector<float>& depth_m, const Eigen::Isometry3d& T_W_C,
                                int steps);

}  // namespace dtsdf
