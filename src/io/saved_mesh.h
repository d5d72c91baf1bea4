/// Saves the mesh of a map, whole or in part, simplified or not. A whole mesh that is partly on
/// disk is written piece by piece, if it is saved as .ply without simplification.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "dtsdf_mapping/mesh.h"
#include "dtsdf_mapping/region.h"
#include "dtsdf_mapping/simplify.h"
#include "page/paged_meshes.h"

namespace dtsdf {

/// Contents of a saved file.
struct SavedMesh {
  size_t vertices = 0, triangles = 0;
  double error_m = 0.0;         ///< Measured error of a simplified mesh; else 0.
  std::string loss;             ///< Blocks or precision that the file lacks; empty: none.
  size_t joined_triangles = 0;  ///< Triangles before simplification.
};

/// Saves the mesh, without blocks that are damaged on disk. With a region, saves only triangles
/// wholly inside. An error of 0 means no simplification.
/// @throws std::exception as saveMesh() and simplifyMesh(), if no triangle lies in the region, or
/// if the disk cannot be read.
SavedMesh savePagedMesh(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                        const std::optional<BoxRegion>& region = std::nullopt,
                        double simplify_error_m = 0.0, const SimplifyProgress& progress = nullptr);

}  // namespace dtsdf
