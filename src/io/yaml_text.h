/// Parses YAML texts of one document.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace dtsdf {

/// Like YAML::Load(), but refuses several documents, where YAML::Load() ignores all but the first.
/// @throws YAML::Exception
YAML::Node loadYaml(const std::string& text);

}  // namespace dtsdf
