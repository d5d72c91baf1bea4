/// Surface colours of a model, for rendering and for comparison.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "evaluation/mesh_scene.h"

namespace dtsdf {

using Rgb8 = std::array<uint8_t, 3>;

/// Where the colours of a model come from. For models without colours, there are textures that
/// depend only on the position, so that they are the same in renderings and ground truth.
enum class Texture {
  kVertices,  ///< The colours of the mesh, interpolated between vertices.
  kChecker,   ///< 50 mm cubes in two colours, with edges as sharp as an image can resolve.
  kGradient,  ///< Waves of 0.4 m in each channel, which blur hardly changes.
};

/// @throws std::invalid_argument for an unknown name.
Texture textureFromName(const std::string& name);

/// The colour of a point on a triangle. @pre The mesh has colours if the texture is kVertices.
Rgb8 textureColour(Texture texture, const TriangleMesh& mesh, uint32_t triangle,
                   const Eigen::Vector3f& p);

/// The colour of the mesh at a point on a triangle, not rounded.
Eigen::Vector3d vertexColourAt(const TriangleMesh& mesh, uint32_t triangle,
                               const Eigen::Vector3f& p);

/// Converts an sRGB colour, with channels from 0 to 255, to CIE L*a*b* under daylight (D65).
Eigen::Vector3d toLab(const Eigen::Vector3d& rgb);

}  // namespace dtsdf
