/// Saves the whole mesh of a map or the part in a region, optionally simplified. A mesh that is
/// partly on disk is written piece by piece if it is saved whole, unsimplified and as .ply.
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
  double error_m = 0.0;         ///< Measured error of a simplified mesh; otherwise 0.
  std::string loss;             ///< Describes missing blocks or lost precision, if any.
  size_t joined_triangles = 0;  ///< Triangles before simplification.
};

/// Saves the mesh, without blocks that are damaged on disk. With a region, saves only triangles
/// that lie wholly inside. An error of 0 means no simplification.
/// @throws std::exception like saveMesh() and simplifyMesh(), or if no triangle lies in the region,
/// or if the disk cannot be read.
SavedMesh savePagedMesh(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                        const std::optional<BoxRegion>& region = std::nullopt,
                        double simplify_error_m = 0.0, const SimplifyProgress& progress = nullptr);

}  // namespace dtsdf
