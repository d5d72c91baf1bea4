/// Decides where a mesh that a service call asks for is saved.
#pragma once

#include <string>

namespace dtsdf {

/// The absolute path of a file under `output_directory`, which may start with "~/".
/// @throws std::runtime_error if the name is empty, leads out of the directory, also by a symbolic
/// link, or has the extension of no mesh format; the text says what to do.
std::string resolveMeshPath(const std::string& output_directory, const std::string& file_name);

}  // namespace dtsdf
