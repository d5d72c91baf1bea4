/// Parses YAML with one document, as settings need it.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace dtsdf {

/// Like YAML::Load, but refuses a text with several documents, of which YAML::Load silently ignores
/// all but the first.
/// @throws YAML::Exception with the place and what to do.
YAML::Node loadYaml(const std::string& text);

}  // namespace dtsdf
