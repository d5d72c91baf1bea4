/// The mesh of a map in a file: all of it or a part, with all triangles or fewer. Where some of it
/// lies on disk, the whole comes to memory only if it has to.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "dtsdf_mapping/mesh.h"
#include "dtsdf_mapping/region.h"
#include "dtsdf_mapping/simplify.h"
#include "page/paged_meshes.h"

namespace dtsdf {

/// What of the mesh is saved.
struct SaveChoice {
  std::optional<BoxRegion> region = std::nullopt;  ///< Only triangles wholly in it.
  double simplify_error_m = 0.0;                   ///< 0: all triangles.
  SimplifyProgress go_on = nullptr;                ///< Progress of simplifying; false cancels it.
};

/// What a file holds.
struct SavedMesh {
  size_t vertices = 0, triangles = 0;
  double error_m = 0.0;         ///< Error of a simplified mesh.
  std::string loss;             ///< What the format cannot hold, in words; empty: nothing.
  size_t joined_triangles = 0;  ///< Triangles before it was simplified.
};

/// Nothing is saved where some of it cannot be read now; without what is damaged it is.
/// @throws std::exception as saveMesh() and simplifyMesh() do, if the region is empty, or if some
/// of it is on disk and cannot be read.
SavedMesh savePagedMesh(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                        const SaveChoice& choice);

}  // namespace dtsdf
