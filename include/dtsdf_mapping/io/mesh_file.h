/// Saves a mesh as .ply, .obj, .stl or .glb.
#pragma once

#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// Extensions of the supported formats. Binary .ply (little-endian), .obj and .glb (glTF 2.0,
/// turned so that y is up) have normals and colours; in .obj, colours follow the positions, an
/// extension that many programs read. Binary .stl has triangles and their normals only.
const std::vector<std::string>& meshExtensions();

/// List of the extensions, for messages.
constexpr const char* kMeshExtensions = ".ply, .obj, .stl or .glb";

/// Extension of a file name, in lower case; empty if it is not one of meshExtensions().
std::string meshFormatOf(const std::string& path);

/// Describes the loss of precision in an .stl file of a mesh far from the origin of the map frame;
/// empty for other meshes and formats. For such a mesh, .ply has positions in double, .obj all
/// their digits, and .glb the origin as a translation; .stl has floats only.
std::string lossInFormat(const Mesh& mesh, const std::string& path);

/// Saves a mesh in the format of the extension. Equal meshes give equal bytes. A temporary file in
/// the same folder is written and renamed; missing folders are created.
/// @throws std::runtime_error for an unknown extension, a mesh without triangles, a mesh too large
/// for the format (.glb: 4 GiB), or a file that cannot be written; the message names the path and
/// says what to do.
void saveMesh(const Mesh& mesh, MeshColour colour, const std::string& path);

}  // namespace dtsdf
