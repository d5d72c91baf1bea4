#include "dtsdf_mapping/io/yaml_params.h"

#include <algorithm>
#include <stdexcept>

#include "io/text_file.h"
#include "io/yaml_text.h"

namespace dtsdf {
namespace {

std::string placeOf(const std::string& name, const YAML::Mark& mark) {
  return mark.is_null() ? name : name + ":" + std::to_string(mark.line + 1);
}

[[noreturn]] void throwAt(const std::string& name, const YAML::Mark& mark,
                          const std::string& problem) {
  throw std::runtime_error(placeOf(name, mark) + ": " + problem);
}

ParamValue valueOfPlainText(const std::string& text) {
  for (const char* word : {"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"}) {
    if (text == word) return true;
  }
  for (const char* word : {"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"}) {
    if (text == word) return false;
  }
  int whole = 0;
  if (parseNumber(text, whole)) return whole;
  double number = 0.0;
  if (parseNumber(text, number)) return number;
  return text;
}

ParamValue valueOf(const YAML::Node& scalar) {
  const bool quoted = scalar.Tag() == "!" || scalar.Tag() == "tag:yaml.org,2002:str";
  if (quoted) return scalar.Scalar();
  return valueOfPlainText(scalar.Scalar());
}

/// Reads a list of strings, the only kind of list in settings.
ParamValue namesOf(const YAML::Node& sequence, const std::string& key, const std::string& name) {
  std::vector<std::string> names;
  for (const YAML::Node& item : sequence) {
    if (!item.IsScalar() || !std::holds_alternative<std::string>(valueOf(item))) {
      throwAt(name, item.Mark(), key + ": a list must contain names only");
    }
    names.push_back(item.Scalar());
  }
  return names;
}

/// Maximum nesting depth, since a YAML alias can make a node contain itself.
constexpr std::ptrdiff_t kMaxLevels = 8;

/// Adds the contents of a node under `prefix` ("" or "section/").
void flatten(const YAML::Node& node, const std::string& prefix, const std::string& name,
             ParamTree& tree) {
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) throwAt(name, entry.first.Mark(), "a key must be a string");
    const std::string key = prefix + entry.first.Scalar();
    const YAML::Node& value = entry.second;
    if (std::count(key.begin(), key.end(), '/') > kMaxLevels) {
      throwAt(name, entry.first.Mark(), "too many levels of nested keys");
    }
    if (value.IsMap()) {
      flatten(value, key + "/", name, tree);
    } else if (!value.IsScalar() && !value.IsSequence()) {
      throwAt(name, entry.first.Mark(), key + " has no value; give one or remove the key");
    } else if (!tree.emplace(key, value.IsSequence() ? namesOf(value, key, name) : valueOf(value))
                    .second) {
      throwAt(name, entry.first.Mark(), key + " is given twice; remove one");
    }
  }
}

}  // namespace

ParamTree parseYamlParams(const std::string& text, const std::string& name) {
  ParamTree tree;
  try {
    const YAML::Node root = loadYaml(text);
    if (root.IsNull()) return tree;
    if (!root.IsMap()) throwAt(name, root.Mark(), "settings must be written as 'key: value'");
    flatten(root, "", name, tree);
  } catch (const YAML::Exception& e) {
    throwAt(name, e.mark, "not valid YAML: " + e.msg);
  }
  return tree;
}

ParamTree loadYamlParams(const std::string& path) {
  return parseYamlParams(readTextFile(path, "give the path of a YAML file with settings"), path);
}

void setParam(const std::string& assignment, ParamTree& tree) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == assignment.size()) {
    throw std::runtime_error("'" + assignment +
                             "' is not of the form key=value, as in map/voxel_size_m=0.01");
  }
  if (assignment.find('\0') != std::string::npos) {
    throw std::runtime_error("a setting contains a NUL character");
  }
  const std::string key = assignment.substr(0, equals);
  const std::string value = assignment.substr(equals + 1);
  try {
    const YAML::Node node = loadYaml(value);
    if (!node.IsScalar() && !node.IsSequence()) {
      throw std::runtime_error(key + ": '" + value + "' is neither a value nor a list");
    }
    tree[key] = node.IsSequence() ? namesOf(node, key, assignment) : valueOf(node);
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(key + ": '" + value + "' is not valid YAML: " + e.msg);
  }
}

}  // namespace dtsdf
