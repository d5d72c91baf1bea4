/// Saves a mesh with textures, as .obj or .glb.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// The texture of some triangles of a mesh.
struct TexturePage {
  size_t triangles;  ///< So many, after those of the page before.
  std::string png;   ///< Its file.
};

/// A place in a page: shares of its width from the left, of its height from the top.
using TexturePlace = std::array<float, 2>;

struct TexturedMesh {
  Mesh mesh;  ///< The triangles of each page follow those of the one before.
  std::vector<std::array<TexturePlace, 3>> places;  ///< Places of each triangle's corners.
  std::vector<TexturePage> pages;
};

/// OUT.obj with OUT.mtl and OUT_0.png, OUT_1.png ... beside it, or OUT.glb with all of it inside.
/// @throws std::runtime_error as saveMesh(), also for another format.
void saveTexturedMesh(const TexturedMesh& textured, const std::string& path);

}  // namespace dtsdf
