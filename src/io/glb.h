/// Writes a mesh as binary glTF 2.0 (.glb).
#pragma once

#include <cstdint>

#include "dtsdf_mapping/mesh.h"
#include "io/atomic_file.h"
#include "io/textured_mesh.h"

namespace dtsdf {

/// Upper bound on the size, in bytes, of a file without textures.
uint64_t maxGlbBytes(uint64_t vertices, uint64_t triangles);

/// Maximum file size, as the format stores sizes as 32-bit numbers.
constexpr uint64_t kMaxGlbBytes = 0xffffffffu;

/// Writes a mesh with normals and linear colours. As z points up in the map frame but y in glTF,
/// the root node rotates the mesh. Positions are relative to an origin near the mesh, so that they
/// are precise as floats even far from the origin of the map frame; a child node adds that origin.
/// @pre maxGlbBytes() is at most kMaxGlbBytes; the mesh is not empty.
void writeGlb(const Mesh& mesh, MeshColour colour, AtomicFile& file);

/// Writes a textured mesh, to be rendered without lighting (KHR_materials_unlit). Each triangle has
/// its own vertices. @throws std::runtime_error if the file would be too large.
void writeGlb(const TexturedMesh& textured, AtomicFile& file);

}  // namespace dtsdf
