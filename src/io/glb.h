/// Writes a mesh as binary glTF 2.0 (.glb), by the specification of the Khronos Group.
#pragma once

#include <cstdint>

#include "dtsdf_mapping/mesh.h"
#include "io/atomic_file.h"
#include "io/textured_mesh.h"

namespace dtsdf {

/// Bytes of a file with so many vertices and triangles, at most.
uint64_t mostGlbBytes(uint64_t vertices, uint64_t triangles);

/// What a file can hold: its sizes are 32-bit numbers.
constexpr uint64_t kMostGlbBytes = 0xffffffffu;

/// Writes a mesh with normals and linear colours. The map frame has z up, glTF y: the root node
/// turns it. The node below it has the mesh's origin, from which its positions count, so that a map
/// far from the origin of its frame keeps its precision in programs that work in float.
/// @pre mostGlbBytes() is at most kMostGlbBytes; the mesh is not empty.
void writeGlb(const Mesh& mesh, MeshColour colour, AtomicFile& file);

/// Writes a mesh with textures, shown as they are, without light (KHR_materials_unlit). Each
/// triangle has vertices of its own. @throws std::runtime_error if it is more than a file can hold.
void writeGlb(const TexturedMesh& textured, AtomicFile& file);

}  // namespace dtsdf
