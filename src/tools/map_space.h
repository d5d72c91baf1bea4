/// What is known of space in a saved map, for programs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "program/command_line.h"
#include "tools/map_settings.h"

namespace dtsdf {

/// What the commands have in common that make something of a map's space.
struct SpaceOutputOptions {
  std::string map_path, out_path;
  std::string what;                   ///< Is written, in words.
  std::vector<std::string> settings;  ///< Each key=value.
  MapLoadLimit limit;
};

/// A mapper that was made from the file, with its surfaces, and the space around them: that which
/// the file holds, and none where it was saved without.
/// @throws std::runtime_error if the file cannot be read, ParamError for wrong settings.
std::unique_ptr<Mapper> loadWithSpace(const SpaceOutputOptions& options);

/// Adds FILE, OUT and --set, and parses; `what` is to be written, and `ending` is how its name has
/// to end. @throws UsageError
void parseSpaceOutput(CommandLine& line, const std::vector<std::string>& arguments,
                      const std::string& what, const std::string& ending,
                      SpaceOutputOptions& options);

}  // namespace dtsdf
