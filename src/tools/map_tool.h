/// What `map_tool` can do with a map file: a function for each of its commands.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

/// Each takes the arguments behind its name. @throws UsageError, TextRequest for --help,
/// std::runtime_error for files that cannot be read or written.
void printMapInfo(const std::vector<std::string>& arguments);
void meshMap(const std::vector<std::string>& arguments);
void saveOcTree(const std::vector<std::string>& arguments);
void drawSlice(const std::vector<std::string>& arguments);
void renderMap(const std::vector<std::string>& arguments);

}  // namespace dtsdf
