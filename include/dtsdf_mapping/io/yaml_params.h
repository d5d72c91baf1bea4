/// Settings from YAML files and from key=value strings, as a flat tree that ParamReader checks.
#pragma once

#include <string>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Reads a YAML file; nested sections become keys such as "map/voxel_size_m". An empty file is an
/// empty tree. Strings in quotes stay strings; true/false, yes/no and on/off are flags.
/// @throws std::runtime_error with the file, and the line if it is known, for a file that is
/// missing or not YAML, lists of anything but names, keys without a value, and keys given twice.
ParamTree loadYamlParams(const std::string& path);

/// Reads settings from a YAML string, which error messages call `name`.
ParamTree parseYamlParams(const std::string& text, const std::string& name);

/// Sets one key of the tree from an assignment such as "map/voxel_size_m=0.01".
/// @throws std::runtime_error if the assignment does not have this form, or the value is neither a
/// single value nor a list of names.
void setParam(const std::string& assignment, ParamTree& tree);

}  // namespace dtsdf
