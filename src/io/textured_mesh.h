/// Saves a mesh with textures, as .obj or .glb.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// Texture coordinates from 0 to 1, measured from the left and top edges of a page.
using TexturePlace = std::array<float, 2>;

struct TexturedMesh {
  Mesh mesh;                                        ///< Triangles are sorted by page.
  std::vector<std::array<TexturePlace, 3>> places;  ///< For each triangle's corners.
  std::vector<std::string> pages;                   ///< Texture images: contents of PNG files.
  std::vector<size_t> page_triangles;               ///< Number of triangles on each page.
};

/// Saves OUT.obj with OUT.mtl and OUT_0.png, OUT_1.png ... in the same folder, or OUT.glb, which
/// contains everything. @throws std::runtime_error like saveMesh(), and for other formats.
void saveTexturedMesh(const TexturedMesh& textured, const std::string& path);

}  // namespace dtsdf
