/// YAML as settings need it: one document.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace dtsdf {

/// YAML::Load of a text with one document. More are refused, which YAML::Load passes over in
/// silence.
/// @throws YAML::Exception with the place and what to do.
YAML::Node loadYaml(const std::string& text);

}  // namespace dtsdf
