/// What `map_tool` can do with a map file: a function for each of its commands, and what they have
/// in common.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "program/command_line.h"
#include "tools/map_settings.h"

namespace dtsdf {

/// Each takes the arguments behind its name. @throws UsageError, TextRequest for --help,
/// std::runtime_error for files that cannot be read or written.
void printMapInfo(const std::vector<std::string>& arguments);
void meshMap(const std::vector<std::string>& arguments);
void saveOcTree(const std::vector<std::string>& arguments);
void drawSlice(const std::vector<std::string>& arguments);
void renderMap(const std::vector<std::string>& arguments);
void printBoxes(const std::vector<std::string>& arguments);
void joinBoxes(const std::vector<std::string>& arguments);
void exportJournal(const std::vector<std::string>& arguments);
void compareMaps(const std::vector<std::string>& arguments);
void textureMap(const std::vector<std::string>& arguments);
void printHash(const std::vector<std::string>& arguments);

/// Options of the commands that make something of a map.
struct MapToolOptions {
  std::string map_path, out_path;
  std::string what;                   ///< What is written, in words.
  std::vector<std::string> settings;  ///< Each key=value.
  size_t most_bytes = kNoMapLimit;    ///< Memory that the map may take.
};

/// Adds FILE and OUT, which `out` explains.
void addPaths(CommandLine& line, const std::string& out, MapToolOptions& options);

/// Adds --set, where `keys` are worth it.
void addSettings(CommandLine& line, const std::string& keys, MapToolOptions& options);

/// A mapper that was made from the file, and its settings: those given, and then `fixed`.
/// @throws std::runtime_error if the file cannot be read, ParamError for wrong settings.
std::pair<RunSettings, std::unique_ptr<Mapper>> loadMapOf(const MapToolOptions& options,
                                                          const char* fixed);

/// The mesh of a mapper that was just made: all of it.
Mesh meshOf(Mapper& mapper, float voxel_size_m);

/// A mapper that was made from the file, with its surfaces, and the space around them: that which
/// the file holds, and none where it was saved without. @throws as loadMapOf() does.
std::unique_ptr<Mapper> loadWithSpace(const MapToolOptions& options);

/// Adds FILE, OUT and --set, and parses; `what` is to be written, and `ending` is how its name has
/// to end. @throws UsageError
void parseSpaceOutput(CommandLine& line, const std::vector<std::string>& arguments,
                      const std::string& what, const std::string& ending, MapToolOptions& options);

}  // namespace dtsdf
