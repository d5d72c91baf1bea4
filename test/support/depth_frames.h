/// Depth images of analytic scenes, and meshes reconstructed from them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "simulation/scene.h"

namespace dtsdf {

/// A depth image in metres that owns its pixels.
struct SceneFrame {
  DepthFrame frame;
  std::vector<float> depth_m;

  /// Valid until this object is moved or destroyed.
  DepthFrame view() const {
    DepthFrame copy = frame;
    copy.data = depth_m.data();
    return copy;
  }
};

/// Renders an image with a horizontal field of view of 65 degrees.
SceneFrame renderFrame(const Scene& scene, const Eigen::Isometry3d& T_W_C, int width = 160,
                       int height = 120);

std::vector<SceneFrame> renderFrames(const Scene& scene,
                                     const std::vector<Eigen::Isometry3d>& T_W_C, int width = 160,
                                     int height = 120);

/// A 3 x 2.4 x 2 m room that contains a ball.
Scene makeBallRoom();

/// Images from a slightly moving camera of a box that moves along a wall and disappears after 12
/// frames.
std::vector<SceneFrame> movingFrames(int count);

/// Poses of `count` cameras spread evenly over a sphere of radius `distance_m`, facing its centre.
std::vector<Eigen::Isometry3d> sphereOfPoses(const Eigen::Vector3d& centre_W, double distance_m,
                                             int count);

MapperParams makeCpuParams(FusionMode mode = FusionMode::kNormalRayCasting, bool directional = true,
                           float voxel_size_m = 0.02f, int threads = 2);

/// Test name of a fusion mode, such as "NormalRayCastingDirectional".
std::string modeName(FusionMode mode, bool directional);

/// Returns `params` with this memory budget and paging folder.
MapperParams pagedParams(MapperParams params, int max_memory_mb, const std::string& folder);

/// Fuses all frames and extracts the mesh. The test fails if a frame is not fused.
Mesh reconstruct(const MapperParams& params, const std::vector<SceneFrame>& frames);

/// Statistics of the distances between mesh vertices and the surface of a scene.
struct SurfaceError {
  double rms_m = 0.0, max_m = 0.0;
  size_t vertices = 0;
};

SurfaceError measureError(const Mesh& mesh, const Scene& scene);

}  // namespace dtsdf
