/// The commands of `map_tool`, one function each, and functions that they share.
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

/// Each of these functions takes the arguments after the command's name. @throws UsageError,
/// TextRequest for --help, std::runtime_error for files that cannot be read or written.
void printMapInfo(const std::vector<std::string>& arguments);
void meshMap(const std::vector<std::string>& arguments);
void saveOcTree(const std::vector<std::string>& arguments);
void renderMap(const std::vector<std::string>& arguments);
void printBoxes(const std::vector<std::string>& arguments);
void joinBoxes(const std::vector<std::string>& arguments);
void exportJournal(const std::vector<std::string>& arguments);
void compareMaps(const std::vector<std::string>& arguments);
void textureMap(const std::vector<std::string>& arguments);
void printHash(const std::vector<std::string>& arguments);

/// Options of the commands that read a map.
struct MapToolOptions {
  std::string map_path, out_path;
  std::vector<std::string> settings;  ///< Each key=value.
};

/// Adds FILE and OUT; `out` is the help text of OUT.
void addPaths(CommandLine& line, const std::string& out, MapToolOptions& options);

/// Adds --set; `keys` lists the relevant keys for the help text.
void addSettings(CommandLine& line, const std::string& keys, MapToolOptions& options);

/// Creates a mapper from the file. The settings in the options override the file's settings, and
/// `fixed`, a key=value, overrides both.
/// @throws std::runtime_error if the file cannot be read, ParamError for wrong settings.
std::pair<RunSettings, std::unique_ptr<Mapper>> loadMapOf(const MapToolOptions& options,
                                                          const char* fixed);

/// The whole mesh of a newly created mapper.
Mesh meshOf(Mapper& mapper, float voxel_size_m);

}  // namespace dtsdf
