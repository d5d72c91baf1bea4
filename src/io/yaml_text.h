/// YAML as settings need it: one document without references.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace dtsdf {

/// YAML::Load of what is one plain document. References (`*name`) are refused: one that refers to
/// itself has no end, and a few that refer to each other stand for billions of values. So are
/// further documents, which YAML::Load passes over in silence, and what is too large or too deep.
/// @throws YAML::Exception with the place and what to do.
YAML::Node loadYaml(const std::string& text);

}  // namespace dtsdf
