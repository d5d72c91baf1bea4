#include "io/map_format.h"

#include "params/param_copy.h"
#include "params/text.h"

namespace dtsdf {
namespace map_format {
namespace {

constexpr const char* kBoundSettings[] = {"fusion/mode", "map/directional", "map/truncation_voxels",
                                          "map/voxel_size_m"};

/// The shortest decimal that is parsed as the same number. It always contains a point or an
/// exponent, so that it is not parsed as an integer.
std::string textOf(double number) {
  std::string text;
  for (int digits = 6; digits <= 17; ++digits) {
    text = shortestText(number, digits);
    double back = 0.0;
    if (parseNumber(text, back) && back == number) break;
  }
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string textOf(const ParamValue& value) {
  if (const auto* const word = std::get_if<std::string>(&value)) {
    std::string text = "'";
    for (const char c : *word) text.append(c == '\'' ? 2 : 1, c);  // quotes are doubled in YAML
    return text + "'";
  }
  if (const double* number = std::get_if<double>(&value)) return textOf(*number);
  return toString(value);
}

}  // namespace

ParamTree settingsOfFile(const ParamTree& of_map, const PoseParams& poses) {
  ParamTree settings = copyOf(of_map);
  for (auto& [key, value] : toTree(poses)) {
    settings.erase(key);
    if (poses.mode != PoseMode::kTf) settings.emplace(key, value);
  }
  return settings;
}

PoseParams posesOf(const ParamTree& settings) {
  PoseParams poses;
  ParamTree known = toTree(poses);
  for (auto& [key, value] : known) {
    const auto found = settings.find(key);
    if (found != settings.end()) value = found->second;
  }
  ParamReader reader(std::move(known));
  visitParams(poses, reader);
  reader.finish();
  return poses;
}

std::string settingsText(const ParamTree& settings) {
  std::string text;
  for (const auto& [key, value] : settings) text += key + ": " + textOf(value) + "\n";
  return text;
}

std::string boundSettingsText(const ParamTree& settings) {
  ParamTree bound;
  for (const char* key : kBoundSettings) {
    const auto found = settings.find(key);
    if (found != settings.end()) bound.insert(*found);
  }
  return settingsText(bound);
}

uint64_t contentHashOf(const MapContents& head, const std::vector<uint64_t>& sums) {
  ByteWriter all, counts;
  const auto add = [&all](const char* kind, const Bytes& content) {
    all.put(checksumOf(kind, content.data(), content.size()));
  };
  counts.putText(boundSettingsText(head.settings)).put(head.frames).put(head.supporting_frames);
  add(kState, counts.bytes);
  visitTables(head, [&](const char* kind, bool is_present, const auto& content) {
    if (is_present) add(kind, encoded(content));
  });
  all.rest(sums);
  return hashOf(all.bytes.data(), all.bytes.size());
}

}  // namespace map_format
}  // namespace dtsdf
