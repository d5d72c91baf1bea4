/// Saves a mesh as .ply, .obj, .stl or .glb.
#pragma once

#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// Extensions of the supported formats. Binary .ply (little-endian), .obj and .glb (glTF 2.0,
/// rotated so that y points up) store normals and colours. In .obj, colours follow the positions,
/// which is a widely supported extension. Binary .stl stores only triangles and their normals.
const std::vector<std::string>& meshExtensions();

/// The extensions as text, for messages.
constexpr const char* kMeshExtensions = ".ply, .obj, .stl or .glb";

/// Extension of a file name, in lower case; empty if the format is not supported.
std::string meshFormatOf(const std::string& path);

/// Describes the precision that is lost if a mesh far from the origin of the map frame is saved as
/// .stl; empty if none is lost. The other formats keep the precision: .ply stores positions as
/// doubles, .obj writes all their digits, and .glb stores the origin as a translation.
std::string lossInFormat(const Mesh& mesh, const std::string& path);

/// Saves a mesh in the format given by the file extension. Writes a temporary file in the same
/// folder and renames it; creates missing folders. Equal meshes give equal bytes.
/// @throws std::runtime_error for an unknown extension, a mesh without triangles, a mesh too large
/// for the format (.glb: 4 GiB), or a file that cannot be written; the message names the path and
/// says what to do.
void saveMesh(const Mesh& mesh, MeshColour colour, const std::string& path);

}  // namespace dtsdf
