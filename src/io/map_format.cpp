#include "io/map_format.h"

#include <locale>
#include <sstream>

#include "io/text_file.h"
#include "params/param_copy.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace map_format {
namespace {

constexpr const char* kBoundSettings[] = {"fusion/mode", "map/directional", "map/truncation_voxels",
                                          "map/voxel_size_m"};

int countBits(uint64_t bits) { return __builtin_popcountll(bits); }

/// The shortest decimal that reads back as the same number, with a point so that it stays no whole
/// one.
std::string textOf(double number) {
  std::string text;
  for (int digits = 6; digits <= 17; ++digits) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(digits);
    out << number;
    text = out.str();
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

Bytes encodeHeader(const SectionHeader& header) {
  ByteWriter out;
  out.putText(header.name());
  out.put(header.version);
  out.put(header.flags);
  out.put(header.stored_bytes);
  out.put(header.content_bytes);
  out.put(header.hash);
  out.put(hashOf(out.bytes.data(), out.bytes.size()));
  return std::move(out.bytes);
}

bool decodeHeader(const uint8_t* bytes, SectionHeader& header) {
  std::copy_n(bytes, header.id.size(), header.id.begin());
  ByteReader in(bytes + header.id.size());
  header.version = in.take<uint16_t>();
  header.flags = in.take<uint16_t>();
  header.stored_bytes = in.take<uint64_t>();
  header.content_bytes = in.take<uint64_t>();
  header.hash = in.take<uint64_t>();
  return in.take<uint64_t>() == hashOf(bytes, kSectionHeaderBytes - sizeof(uint64_t));
}

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
  out.put(contents.frames);
  out.put(contents.supporting_frames);
  out.put(uint64_t{size.blocks});
  out.put(uint64_t{size.voxel_arrays});
  out.put(uint64_t{kBlocksPerChunk});
  out.put(contents.stamp_s);
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

ChunkBounds boundsOf(const std::vector<MapBlock>& blocks, size_t blocks_per_chunk) {
  ChunkBounds bounds;
  size_t voxel_words = 0, colour_words = 0;
  for (size_t i = 0; i < blocks.size(); ++i) {
    if (i % blocks_per_chunk == 0) {
      bounds.block.push_back(i);
      bounds.voxel_word.push_back(voxel_words);
      bounds.colour_word.push_back(colour_words);
    }
    voxel_words += static_cast<size_t>(countBits(blocks[i].directions)) * kArrayWords;
    colour_words += static_cast<size_t>(countBits(blocks[i].bricks)) * kBrickWords;
  }
  bounds.block.push_back(blocks.size());
  bounds.voxel_word.push_back(voxel_words);
  bounds.colour_word.push_back(colour_words);
  return bounds;
}

ContentHash::ContentHash(const MapContents& contents, const MapSize& size)
    : contents_(contents), size_(size), of_voxels_(size.blocks) {
  if (contents.painted) of_colours_.resize(size.blocks);
}

void ContentHash::addVoxels(const ChunkBounds& bounds, size_t chunk, const uint64_t* words) {
  for (size_t i = bounds.block[chunk]; i < bounds.block[chunk + 1]; ++i) {
    const size_t count =
        static_cast<size_t>(countBits(contents_.blocks[i].directions)) * kArrayWords;
    of_voxels_[i] = hashOf(words, count * sizeof(uint64_t));
    words += count;
  }
}

void ContentHash::addColours(const ChunkBounds& bounds, size_t chunk, const uint32_t* words) {
  for (size_t i = bounds.block[chunk]; i < bounds.block[chunk + 1]; ++i) {
    const size_t count = static_cast<size_t>(countBits(contents_.blocks[i].bricks)) * kBrickWords;
    of_colours_[i] = hashOf(words, count * sizeof(uint32_t));
    words += count;
  }
}

uint64_t ContentHash::result() const {
  ByteWriter out;
  out.putText(boundSettingsText(contents_.settings));
  out.put(contents_.frames);
  out.put(contents_.supporting_frames);
  const auto append = [&](const Bytes& bytes) {
    out.bytes.insert(out.bytes.end(), bytes.begin(), bytes.end());
  };
  append(encodeBlocks(contents_.blocks));
  for (const uint64_t hash : of_voxels_) out.put(hash);
  if (contents_.painted) {
    append(encodeColourIndex(contents_));
    for (const uint64_t hash : of_colours_) out.put(hash);
  }
  if (contents_.cell_voxels != 0) append(encodeFree(contents_));
  return hashOf(out.bytes.data(), out.bytes.size());
}

}  // namespace map_format

uint64_t contentHash(const MapContents& contents, int threads) {
  using namespace map_format;
  checkContents(contents);
  const MapSize size = sizeOf(contents.blocks);
  const ChunkBounds bounds = boundsOf(contents.blocks, kBlocksPerChunk);
  ContentHash hash(contents, size);
  parallelFor(bounds.count(), threads, [&](size_t chunk) {
    hash.addVoxels(bounds, chunk, contents.voxels.data() + bounds.voxel_word[chunk]);
    if (!contents.painted) return;
    hash.addColours(bounds, chunk, contents.colours.data() + bounds.colour_word[chunk]);
  });
  return hash.result();
}

}  // namespace dtsdf
