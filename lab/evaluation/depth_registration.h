/// Aligns depth images with a mesh, to separate pose errors from errors in the mesh.
#pragma once

#include <vector>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"

namespace dtsdf {

/// Aligns a depth image with the mesh in `steps` point-to-plane Gauss-Newton steps, and returns the
/// resulting pose. The planes are those of the triangles that the rays hit. Pixels whose depth is
/// off by more than a limit are ignored, and pixels near the limit get little weight. The limit is
/// 20 % of the depth, at most 0.4 m, in the first step, half of that in the second, and a quarter
/// of it in all further steps. The image is not moved in directions that the mesh does not
/// constrain, such as along a single wall. Returns `T_W_C` if fewer than 50 points remain in any
/// step. The depth is row-major, in metres; 0: no depth.
Eigen::Isometry3d registerDepth(const MeshScene& scene, const ViewCamera& camera,
                                const std::vector<float>& depth_m, const Eigen::Isometry3d& T_W_C,
                                int steps);

}  // namespace dtsdf
