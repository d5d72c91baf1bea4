/// Saves a mesh as .ply, .obj, .stl or .glb.
#pragma once

#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// The extensions of the formats: .ply, binary little-endian, and .glb, binary glTF 2.0, turned so
/// that y is up, have normals and colours; .obj, text, has colours behind the positions, as many
/// programs read them; .stl, binary, has triangles and their normals only.
const std::vector<std::string>& meshExtensions();

/// The extensions, for messages.
constexpr const char* kMeshExtensions = ".ply, .obj, .stl or .glb";

/// The extension of a file name, in lower case; empty if it is not one of these.
std::string meshFormatOf(const std::string& path);

/// What a file of this name cannot hold of the mesh, in words; empty if it holds all. Where the
/// mesh is far from the origin of the map frame, .ply has positions in double, .obj all their
/// digits, .glb the origin as a translation; .stl has floats only.
std::string lossInFormat(const Mesh& mesh, const std::string& path);

/// Saves a mesh in the format of the extension. Equal meshes give equal bytes. The file is written
/// beside the old one and renamed; missing folders are made.
/// @throws std::runtime_error for an unknown extension, an empty mesh (no triangles), one that the
/// format cannot hold (.glb: 4 GiB), or a file that cannot be written; the text names the path and
/// says what to do.
void saveMesh(const Mesh& mesh, MeshColour colour, const std::string& path);

}  // namespace dtsdf
