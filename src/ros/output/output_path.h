/// Decides where files lie that service calls name: the one rule for all services.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

/// A path that may start with "~/" or be "~", the home folder.
/// @throws std::runtime_error if HOME is not set; `name` says whose path it is.
std::string expandHome(const std::string& path, const std::string& name);

/// The absolute path of a file under `output_directory`, which may start with "~/". `extensions`
/// are those that are allowed, in any case, as in {".ply", ".obj"}.
/// @throws std::runtime_error if the name is empty or has control characters, lies outside the
/// directory, also by a symbolic link, or has another extension; the text says what to do.
std::string resolveOutputPath(const std::string& output_directory, const std::string& file_name,
                              const std::vector<std::string>& extensions);

}  // namespace dtsdf
