/// Saves a mesh as .ply, .obj, .stl or .glb.
#pragma once

#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// Extensions of the supported formats. Binary .ply (little-endian), .obj and .glb (glTF 2.0,
/// rotated so that y points up) store normals and colours; in .obj, colours follow the positions,
/// an extension that many programs support. Binary .stl stores only triangles and their normals.
const std::vector<std::string>& meshExtensions();

/// List of the extensions, for messages.
constexpr const char* kMeshExtensions = ".ply, .obj, .stl or .glb";

/// Extension of a file name, in lower case; empty if it is not one of meshExtensions().
std::string meshFormatOf(const std::string& path);

/// Describes the loss of precision in an .stl file of a mesh far from the origin of the map frame;
/// empty for other meshes and formats. The other formats keep the precision of such a mesh: .ply
/// stores positions as doubles, .obj writes all their digits, and .glb stores the origin as a
/// translation.
std::string lossInFormat(const Mesh& mesh, const std::string& path);

/// Saves a mesh in the format that the extension selects. Writes a temporary file in the same
/// folder and renames it; creates missing folders. Equal meshes give equal bytes.
/// @throws std::runtime_error for an unknown extension, a mesh without triangles, a mesh too large
/// for the format (.glb: 4 GiB), or a file that cannot be written; the message names the path and
/// says what to do.
void saveMesh(const Mesh& mesh, MeshColour colour, const std::string& path);

}  // namespace dtsdf
