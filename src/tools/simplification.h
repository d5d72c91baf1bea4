/// Simplified meshes, for the programs that save them.
#pragma once

#include "dtsdf_mapping/mesh.h"
#include "program/command_line.h"

namespace dtsdf {

/// Adds --simplify-error.
void addSimplifyOption(CommandLine& line, double& error_m);

/// Leaves the mesh as it is for an error of 0; else simplifies it and prints what came out.
/// @throws UsageError for an error that is larger than the mesh.
void simplify(Mesh& mesh, double error_m);

}  // namespace dtsdf
