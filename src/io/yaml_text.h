/// Parses YAML texts that consist of a single document.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace dtsdf {

/// Like YAML::Load(), but rejects a second document, which YAML::Load() would ignore.
/// @throws YAML::Exception
inline YAML::Node loadYaml(const std::string& text) {
  const std::vector<YAML::Node> documents = YAML::LoadAll(text);
  if (documents.size() < 2) return documents.empty() ? YAML::Node() : documents.front();
  throw YAML::Exception(YAML::Mark::null_mark(), "more than one YAML document; use one");
}

}  // namespace dtsdf
