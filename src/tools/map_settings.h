/// Settings and options of programs that read a map or save its mesh.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "io/saved_mesh.h"
#include "tools/run_options.h"

namespace dtsdf {

/// Settings for a mapper that loads a saved map: the known keys of the map file, overridden by the
/// key=value texts in `given`. If map/page_folder is empty, the memory limit is what the map needs.
/// @throws ParamError that lists every violation, std::runtime_error if the settings do not fit the
/// map.
RunSettings settingsFor(const MapContents& contents, const std::vector<std::string>& given);

/// @throws UsageError unless the name has the extension of a mesh format.
void checkMeshPath(const std::string& path);

/// Adds --simplify-error.
void addSimplifyOption(CommandLine& line, double& error_m);

/// Saves the whole mesh; if `error_m` is not 0, simplifies it and prints the result.
/// @throws UsageError if `error_m` exceeds the size of the mesh, and whatever savePagedMesh()
/// throws.
SavedMesh saveSimplified(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                         double error_m);

}  // namespace dtsdf
