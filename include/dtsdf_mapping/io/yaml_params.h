/// Reads settings from YAML files and key=value strings into a ParamTree, which ParamReader
/// checks.
#pragma once

#include <string>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Reads a YAML file; nested sections become keys such as "map/voxel_size_m". An empty file gives
/// an empty tree. Quoted strings stay strings; true/false, yes/no and on/off are Booleans.
/// @throws std::runtime_error if the file is missing or not valid YAML, or if it contains a list of
/// anything but names, a key without a value, or a key twice. The message names the file and, if
/// known, the line.
ParamTree loadYamlParams(const std::string& path);

/// Reads settings from a YAML string. Error messages refer to it as `name`.
ParamTree parseYamlParams(const std::string& text, const std::string& name);

/// Sets one key of the tree from an assignment such as "map/voxel_size_m=0.01".
/// @throws std::runtime_error if the assignment does not have this form, or the value is neither a
/// single value nor a list of names.
void setParam(const std::string& assignment, ParamTree& tree);

}  // namespace dtsdf
