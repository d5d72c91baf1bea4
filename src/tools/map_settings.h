/// What programs have in common that read a map or save its mesh: the settings to continue it with,
/// and their options.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "io/saved_mesh.h"
#include "tools/run_options.h"

namespace dtsdf {

/// What a mapper of a saved map is made with: the settings of the file, as far as this version
/// knows them, and then those that are given, each key=value. The budget is what the map needs.
/// @throws ParamError with every violation.
RunSettings settingsFor(const MapContents& contents, const std::vector<std::string>& given);

/// Adds --max-memory-mb: how large a map may be that a program loads, as a small file can ask for
/// much memory. The limit is the default then.
void addLoadLimit(CommandLine& line, size_t& most_bytes);

/// @throws UsageError unless a mesh can be saved under this name.
void checkMeshPath(const std::string& path);

/// Adds --simplify-error.
void addSimplifyOption(CommandLine& line, double& error_m);

/// Saves the whole mesh; for an error other than 0 simplified, and prints what came out.
/// @throws UsageError for an error that is larger than the mesh, and as savePagedMesh().
SavedMesh saveSimplified(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                         double error_m);

}  // namespace dtsdf
