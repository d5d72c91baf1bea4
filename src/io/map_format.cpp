#include "io/map_format.h"

#include <sstream>

#include "io/text_file.h"
#include "map/map_head.h"
#include "params/param_copy.h"

namespace dtsdf {
namespace map_format {
namespace {

constexpr const char* kBoundSettings[] = {"fusion/mode", "map/directional", "map/truncation_voxels",
                                          "map/voxel_size_m"};

/// The shortest decimal that reads back as the same number, with a point so that it stays no whole
/// one.
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
  if (const double* number = std::get_if<double>(&value)) return textOf(*number);
  return toString(value);
}

bool parseValue(const std::string& text, ParamValue& value) {
  if (text == "true" || text == "false") {
    value = text == "true";
    return true;
  }
  if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'') {
    value = text.substr(1, text.size() - 2);
    return true;
  }
  int whole = 0;
  double number = 0.0;
  if (parseNumber(text, whole)) {
    value = whole;
  } else if (parseNumber(text, number)) {
    value = number;
  } else {
    return false;
  }
  return true;
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

bool parseSettings(const std::string& text, ParamTree& settings) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const size_t colon = line.find(": ");
    if (colon == std::string::npos || colon == 0) return false;
    if (!parseValue(line.substr(colon + 2), settings[line.substr(0, colon)])) return false;
  }
  return true;
}

std::string boundSettingsText(const ParamTree& settings) {
  ParamTree bound;
  for (const char* key : kBoundSettings) {
    const auto found = settings.find(key);
    if (found != settings.end()) bound.insert(*found);
  }
  return settingsText(bound);
}

Bytes encodeState(const MapContents& contents, const MapSize& size) {
  ByteWriter out;
  out.put(contents.frames).put(contents.supporting_frames);
  out.put(uint64_t{size.blocks}).put(uint64_t{size.voxel_arrays}).put(contents.stamp_s);
  return std::move(out.bytes);
}

Bytes encodeBox(const MapBox& box) {
  ByteWriter out;
  out.putKey(box.first).putKey(box.last).put(box.recordings);
  for (const IndexRanges* const frames : {&box.fused, &box.supporting}) {
    out.put(uint64_t{frames->size()});
    for (const auto& [first, last] : *frames) out.put(first).put(last);
  }
  return std::move(out.bytes);
}

Bytes encodeBlocks(const std::vector<MapBlock>& blocks) {
  ByteWriter out;
  out.bytes.reserve(blocks.size() * kBlockBytes);
  for (const MapBlock& block : blocks) {
    out.putKey(block.key).put(block.directions);
  }
  return std::move(out.bytes);
}

Bytes encodeColourIndex(const MapContents& contents) {
  ByteWriter out;
  out.bytes.reserve(kColourHeadBytes + contents.blocks.size() * kBlockBricksBytes);
  for (const float gain : contents.exposure) out.put(gain);
  out.put(uint32_t{0});
  for (const MapBlock& block : contents.blocks) out.put(block.bricks);
  return std::move(out.bytes);
}

Bytes encodeFree(const MapContents& contents) {
  ByteWriter out;
  out.bytes.reserve(kFreeHeadBytes + contents.free_cubes.size() * kFreeRecordBytes);
  out.put(static_cast<uint32_t>(contents.cell_voxels));
  out.put(uint32_t{0});
  for (const MapFreeCube& cube : contents.free_cubes) {
    out.putKey(cube.key).put(uint32_t{0});
    for (const uint64_t word : cube.cells) out.put(word);
  }
  return std::move(out.bytes);
}

ChunkBounds boundsOf(const std::vector<MapBlock>& blocks) {
  ChunkBounds bounds;
  size_t voxel_words = 0, colour_words = 0;
  const auto note = [&](size_t block) {
    bounds.block.push_back(block);
    bounds.voxel_word.push_back(voxel_words);
    bounds.colour_word.push_back(colour_words);
  };
  for (size_t i = 0; i < blocks.size(); ++i) {
    if (i % kBlocksPerChunk == 0) note(i);
    voxel_words += voxelWordsOf(blocks[i]);
    colour_words += colourWordsOf(blocks[i]);
  }
  note(blocks.size());
  return bounds;
}

ContentHash::ContentHash(const MapContents& head) {
  const auto add_content = [this](const char* kind, const Bytes& content) {
    add(checksumOf(kind, content.data(), content.size()));
  };
  ByteWriter counts;
  counts.putText(boundSettingsText(head.settings)).put(head.frames).put(head.supporting_frames);
  add_content(kState, counts.bytes);
  add_content(kBlocks, encodeBlocks(head.blocks));
  if (head.painted) add_content(kColourIndex, encodeColourIndex(head));
  if (head.cell_voxels != 0) add_content(kFree, encodeFree(head));
}

}  // namespace map_format
}  // namespace dtsdf
