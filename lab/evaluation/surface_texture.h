/// Colours of a model's surface, for rendering and comparing.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "evaluation/mesh_scene.h"

namespace dtsdf {

using Rgb8 = std::array<uint8_t, 3>;

/// Where a model's colours come from. Models without colours get a texture that depends only
/// on the position, so that renderings and ground truth agree on it.
enum class Texture {
  kVertices,  ///< The mesh's own, interpolated between vertices.
  kChecker,   ///< Cubes of 50 mm in two colours: edges as sharp as an image can show.
  kGradient,  ///< Waves of 0.4 m in each channel, which are hardly changed by blur.
};

/// @throws std::invalid_argument for an unknown name.
Texture textureFromName(const std::string& name);

/// The colour of a point on a triangle. @pre The mesh has colours if the texture is kVertices.
Rgb8 textureColour(Texture texture, const TriangleMesh& mesh, uint32_t triangle,
                   const Eigen::Vector3f& p);

/// The mesh's own colour at a point of a triangle, before rounding.
Eigen::Vector3d vertexColourAt(const TriangleMesh& mesh, uint32_t triangle,
                               const Eigen::Vector3f& p);

/// CIE L*a*b* of an sRGB colour with channels from 0 to 255, for daylight (D65).
Eigen::Vector3d toLab(const Eigen::Vector3d& rgb);

}  // namespace dtsdf
