/// What `tiles` can do: a function for each of its commands, but for `run`, which needs MPI.
#pragma once

#include <string>
#include <vector>

#include "program/command_line.h"
#include "tiles/merge_tiles.h"

namespace dtsdf {

/// Each takes the arguments behind its name. @throws UsageError, TextRequest for --help,
/// std::runtime_error
void planCommand(const std::vector<std::string>& arguments);
void fuseCommand(const std::vector<std::string>& arguments);
void mergeCommand(const std::vector<std::string>& arguments);
void statusCommand(const std::vector<std::string>& arguments);
void slurmCommand(const std::vector<std::string>& arguments);
void runTilesCommand(const std::vector<std::string>& arguments);

}  // namespace dtsdf
