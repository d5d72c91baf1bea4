/// Depth frames of analytic scenes, and meshes made from them.
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

/// Renders an image from a camera with a horizontal field of view of 65 degrees.
SceneFrame renderFrame(const Scene& scene, const Eigen::Isometry3d& T_W_C, int width = 160,
                       int height = 120);

std::vector<SceneFrame> renderFrames(const Scene& scene,
                                     const std::vector<Eigen::Isometry3d>& T_W_C, int width = 160,
                                     int height = 120);

/// A 3 x 2.4 x 2 m room with a ball in it.
Scene makeBallRoom();

/// Images of a box that moves along a wall and disappears after 12 frames, from a camera that moves
/// slightly.
std::vector<SceneFrame> movingFrames(int count);

/// Poses of `count` cameras that look at `centre_W` from `distance_m` away, spread evenly over a
/// sphere.
std::vector<Eigen::Isometry3d> sphereOfPoses(const Eigen::Vector3d& centre_W, double distance_m,
                                             int count);

MapperParams makeCpuParams(FusionMode mode = FusionMode::kNormalRayCasting, bool directional = true,
                           float voxel_size_m = 0.02f, int threads = 2);

/// A name such as "NormalRayCastingDirectional".
std::string modeName(FusionMode mode, bool directional);

/// `params` with this memory budget and this folder for paging.
MapperParams pagedParams(MapperParams params, int max_memory_mb, const std::string& folder);

/// Fuses all frames, then extracts the mesh. The test fails if a frame is not fused.
Mesh reconstruct(const MapperParams& params, const std::vector<SceneFrame>& frames);

/// Distances of a mesh's vertices from the surface of a scene.
struct SurfaceError {
  double rms_m = 0.0, max_m = 0.0;
  size_t vertices = 0;
};

SurfaceError measureError(const Mesh& mesh, const Scene& scene);

}  // namespace dtsdf
