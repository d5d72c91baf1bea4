#include "io/yaml_text.h"

#include <vector>

namespace dtsdf {
YAML::Node loadYaml(const std::string& text) {
  const std::vector<YAML::Node> documents = YAML::LoadAll(text);
  if (documents.size() < 2) return documents.empty() ? YAML::Node() : documents.front();
  throw YAML::Exception(YAML::Mark::null_mark(), "more than one YAML document; use one");
}

}  // namespace dtsdf
