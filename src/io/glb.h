/// Writes a mesh as binary glTF 2.0 (.glb).
#pragma once

#include <cstdint>

#include "dtsdf_mapping/mesh.h"
#include "io/atomic_file.h"
#include "io/textured_mesh.h"

namespace dtsdf {

/// Upper bound on the bytes of a file with this many vertices and triangles.
uint64_t maxGlbBytes(uint64_t vertices, uint64_t triangles);

/// Largest possible file: its sizes are 32-bit numbers.
constexpr uint64_t kMaxGlbBytes = 0xffffffffu;

/// Writes a mesh with normals and linear colours. The map frame has z up, glTF has y up: the root
/// node rotates the mesh. Its child node translates it from an origin near the mesh, so that
/// positions stay precise as floats, however far the mesh is from the origin of the map frame.
/// @pre maxGlbBytes() is at most kMaxGlbBytes; the mesh is not empty.
void writeGlb(const Mesh& mesh, MeshColour colour, AtomicFile& file);

/// Writes a textured mesh, to be shown without lighting (KHR_materials_unlit). Each triangle has
/// its own vertices. @throws std::runtime_error if the file would be too large.
void writeGlb(const TexturedMesh& textured, AtomicFile& file);

}  // namespace dtsdf
