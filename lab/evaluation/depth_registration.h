/// Aligns depth images with a mesh, so that errors of poses and errors of the mesh come apart.
#pragma once

#include <vector>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"

namespace dtsdf {

/// The pose that fits an image best to the mesh, after so many steps of Gauss and Newton on the
/// distances of measured points from the triangles that their rays hit. Pixels farther from the
/// mesh than a bound do not count, and those near it count little. It halves with each step, from
/// 20 % of their depth, or 0.4 m, to 5 %, or 0.1 m. The image keeps its place along what the mesh
/// does not hold it by, as along a single wall, and its pose where fewer than 50 points count. The
/// depth is row-major, in metres, 0 where there is none.
Eigen::Isometry3d registerDepth(const MeshScene& scene, const ViewCamera& camera,
                                const std::vector<float>& depth_m, const Eigen::Isometry3d& T_W_C,
                                int steps);

}  // namespace dtsdf
