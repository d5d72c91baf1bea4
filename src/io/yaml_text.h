/// YAML as settings need it: one document.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace dtsdf {

/// YAML::Load of a text with one document. More are refused, which YAML::Load passes over in
/// silence, and so is what is too large or too deep for its parser.
/// @throws YAML::Exception with the place and what to do.
YAML::Node loadYaml(const std::string& text);

}  // namespace dtsdf
