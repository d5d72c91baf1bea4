#include "io/yaml_text.h"

#include <algorithm>
#include <sstream>
#include <vector>

namespace dtsdf {
namespace {

/// More than any file of settings has; the parser calls itself for each level.
constexpr size_t kMostTextBytes = size_t{1} << 20;
constexpr int kMaxBrackets = 10000, kMaxDashesOfLine = 50;

/// What would have the parser call itself too often, on a glance at the text alone.
void checkText(const std::string& text) {
  const YAML::Mark nowhere = YAML::Mark::null_mark();
  if (text.size() > kMostTextBytes) throw YAML::Exception(nowhere, "too large for settings");
  if (text.find('\0') != text.npos)
    throw YAML::Exception(nowhere, "a string must not contain a NUL character");
  const auto isOpening = [](char c) { return c == '[' || c == '{'; };
  if (std::count_if(text.begin(), text.end(), isOpening) > kMaxBrackets) {
    throw YAML::Exception(nowhere, "too many brackets");
  }
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto isIndicator = [](char c) { return c == '-' || c == '?'; };
    const size_t first = line.find_first_not_of("-? \t");
    if (std::count_if(line.begin(), line.begin() + std::min(first, line.size()), isIndicator) >
        kMaxDashesOfLine) {
      throw YAML::Exception(nowhere, "too many levels");
    }
  }
}

}  // namespace

YAML::Node loadYaml(const std::string& text) {
  checkText(text);
  const std::vector<YAML::Node> documents = YAML::LoadAll(text);
  if (documents.size() < 2) return documents.empty() ? YAML::Node() : documents.front();
  throw YAML::Exception(YAML::Mark::null_mark(), "more than one YAML document; use one");
}

}  // namespace dtsdf
