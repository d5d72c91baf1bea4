/// Depth frames of analytic scenes, and what a mapper makes of them.
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

  /// Valid as long as this object is where it is.
  DepthFrame view() const {
    DepthFrame copy = frame;
    copy.data = depth_m.data();
    return copy;
  }
};

/// A camera of 65 degrees horizontal field of view.
SceneFrame renderFrame(const Scene& scene, const Eigen::Isometry3d& T_W_C, int width = 160,
                       int height = 120);

std::vector<SceneFrame> renderFrames(const Scene& scene,
                                     const std::vector<Eigen::Isometry3d>& T_W_C, int width = 160,
                                     int height = 120);

/// A room of 3 x 2.4 x 2 m with a ball in it, whose walls are not on the grid.
Scene makeBallRoom();

/// A box that moves along a wall and goes after 12 frames, and a camera that moves a little.
std::vector<SceneFrame> movingFrames(int count);

/// `count` cameras round `centre_W` that look at it, spread evenly over the sphere of directions.
std::vector<Eigen::Isometry3d> sphereOfPoses(const Eigen::Vector3d& centre_W, double distance_m,
                                             int count);

/// A CPU mapper's settings.
MapperParams makeCpuParams(FusionMode mode = FusionMode::kNormalRayCasting, bool directional = true,
                           float voxel_size_m = 0.02f, int threads = 2);

/// "NormalRayCastingDirectional" and so on.
std::string modeName(FusionMode mode, bool directional);

/// These settings with a folder for what does not fit into so much memory.
MapperParams pagedParams(MapperParams params, int max_memory_mb, const std::string& folder);

/// Fuses all frames and meshes once; every frame has to be fused.
Mesh reconstruct(const MapperParams& params, const std::vector<SceneFrame>& frames);

/// Distances of a mesh's vertices to the surface of a scene.
struct SurfaceError {
  double rms_m = 0.0, max_m = 0.0;
  size_t vertices = 0;
};

SurfaceError measureError(const Mesh& mesh, const Scene& scene);

}  // namespace dtsdf
