/// Saves the mesh of a map, whole or in part, simplified or not. A mesh that is partly on disk is
/// loaded as a whole only if necessary.
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
  double error_m = 0.0;         ///< Error of a simplified mesh.
  std::string loss;             ///< What the file is missing, in words; empty: nothing.
  size_t joined_triangles = 0;  ///< Triangles before simplification.
};

/// Saves the mesh without damaged blocks, but saves nothing if the disk cannot be read. With a
/// region, only triangles wholly inside. An error of 0 means no simplification.
/// @throws std::exception as saveMesh() and simplifyMesh(), if the region is empty, or if the disk
/// cannot be read.
SavedMesh savePagedMesh(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                        const std::optional<BoxRegion>& region = std::nullopt,
                        double simplify_error_m = 0.0, const SimplifyProgress& progress = nullptr);

}  // namespace dtsdf
