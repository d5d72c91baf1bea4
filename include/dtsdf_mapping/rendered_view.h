/// Depth, normals and colours of the surfaces of a map, rendered for a camera at any pose.
#pragma once

#include <cstddef>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "dtsdf_mapping/geometry.h"
#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// Camera for which a view is rendered: a pinhole camera without distortion.
struct RenderCamera {
  int width = 640;                                        ///< In pixels.
  int height = 480;                                       ///< In pixels.
  Intrinsics intrinsics{525.0f, 525.0f, 319.5f, 239.5f};  ///< Focal lengths and principal point.
};

/// A view of the map: three images of the camera's size, in row-major order without padding. Pixels
/// whose rays hit no surface are 0 in all three.
struct RenderedView {
  int width = 0;   ///< In pixels.
  int height = 0;  ///< In pixels.
  /// Distance along the optical axis, z in the camera's frame, in metres.
  std::vector<float> depth_m;
  /// Unit normals, pointing out of the surface, in the camera's frame (x right, y down, z forward).
  std::vector<Vec3f> normals_C;
  /// Colours of the mesh; empty until the map is first painted.
  std::vector<VertexColour> colours;
};

}  // namespace dtsdf
