#include "io/map_reader.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "threads/parallel.h"

namespace dtsdf {
namespace map_format {
namespace {

/// Chunks that are in memory at a time, however many cores there are.
constexpr int kMostAtOnce = 8;

}  // namespace

MapReader::MapReader(const std::string& path, MapLimit limit) : file_(path), limit_(limit) {
  readSettings();
  readState();
  readBlocks();
  readColourIndex();
  readFree();
  size_ = checkedSize();
  checkRoom(size_);
}

MapContents MapReader::load(int threads) {
  const ChunkBounds bounds = this->bounds();
  const std::vector<const PlacedSection*> voxels = voxelChunks(), colours = colourChunks();
  contents_.voxels = PlainArray<uint64_t>(bounds.voxel_word.back());
  contents_.colours = PlainArray<uint32_t>(bounds.colour_word.back());
  ContentHash hash(contents_, size_);
  parallelFor(bounds.count(), threads, [&](size_t i) {
    readChunk(*voxels[i], bounds.voxel_word, i, contents_.voxels.data());
    hash.addVoxels(bounds, i, contents_.voxels.data() + bounds.voxel_word[i]);
    if (!contents_.painted) return;
    readChunk(*colours[i], bounds.colour_word, i, contents_.colours.data());
    hash.addColours(bounds, i, contents_.colours.data() + bounds.colour_word[i]);
  });
  checkHash(hash);
  checkSoundly([&] { checkContents(contents_); });
  return std::move(contents_);
}

void MapReader::visit(const std::function<void(const MapContents&)>& take) const {
  const ChunkBounds bounds = this->bounds();
  const std::vector<const PlacedSection*> voxels = voxelChunks(), colours = colourChunks();
  ContentHash hash(contents_, size_);
  const auto make = [&](size_t i) {
    MapContents part;
    part.painted = contents_.painted;
    const auto block = [&](size_t at) {
      return contents_.blocks.begin() + static_cast<std::ptrdiff_t>(bounds.block[at]);
    };
    part.blocks.assign(block(i), block(i + 1));
    part.voxels = chunkOf<uint64_t>(*voxels[i], bounds.voxel_word, i);
    hash.addVoxels(bounds, i, part.voxels.data());
    if (!contents_.painted) return part;
    part.colours = chunkOf<uint32_t>(*colours[i], bounds.colour_word, i);
    hash.addColours(bounds, i, part.colours.data());
    return part;
  };
  makeInOrder(bounds.count(), std::min(threadCount(0), kMostAtOnce), make,
              [&](size_t, const MapContents& part) { take(part); });
  checkHash(hash);
}

std::vector<const PlacedSection*> MapReader::colourChunks() const {
  return contents_.painted ? chunks(kColours, bounds()) : std::vector<const PlacedSection*>();
}

MapInfo MapReader::info() {
  MapInfo info;
  static_cast<MapHead&>(info) = contents_;
  info.size = size_;
  info.version = file_.version();
  info.file_bytes = file_.bytes();
  info.content_hash = file_.contentHashInFile();
  findBounds(info);
  listParts(info);
  return info;
}

void MapReader::readSettings() {
  const Bytes settings = file_.readSmall(kSettings), frame = file_.readSmall(kFrame);
  if (!parseSettings({settings.begin(), settings.end()}, contents_.settings)) {
    file_.throwDamaged("its settings are malformed");
  }
  contents_.map_frame.assign(frame.begin(), frame.end());
  checkSoundly([&] {
    withSettingsOf(contents_, {});
    contents_.poses = posesOf(contents_.settings);
  });
  const PlacedSection* const level = file_.find(kLevel);
  if (level == nullptr) return;
  const Bytes pose = file_.read(*level, kPoseBytes);
  contents_.T_W_M = ByteReader(pose.data()).takePose();
}

void MapReader::readState() {
  const Bytes bytes = file_.read(file_.get(kState), kStateBytes);
  ByteReader in(bytes.data());
  contents_.frames = in.take<uint64_t>();
  contents_.supporting_frames = in.take<uint64_t>();
  block_count_ = in.take<uint64_t>();
  array_count_ = in.take<uint64_t>();
  blocks_per_chunk_ = in.take<uint64_t>();
  contents_.stamp_s = in.take<double>();
  constexpr uint64_t kMostArrays = uint64_t{1} << 40;  // so that sizes in bytes fit 64 bits
  if (blocks_per_chunk_ == 0 || blocks_per_chunk_ > kMostBlocksPerChunk ||
      array_count_ > kMostArrays || block_count_ > array_count_ ||
      array_count_ * kArrayWords * sizeof(uint64_t) != voxelBytes()) {
    throwWrongSizes();
  }
  MapSize known;  // before what the blocks hold is read
  known.blocks = block_count_;
  known.voxel_arrays = array_count_;
  checkRoom(known);
}

uint64_t MapReader::voxelBytes() const {
  uint64_t bytes = 0;
  for (const PlacedSection* section : file_.all(kVoxels)) bytes += section->header.content_bytes;
  return bytes;
}

void MapReader::readBlocks() {
  const Bytes bytes = file_.read(file_.get(kBlocks), block_count_ * kBlockBytes);
  ByteReader in(bytes.data());
  contents_.blocks.resize(block_count_);
  for (MapBlock& block : contents_.blocks) {
    block.key = in.takeKey();
    block.directions = in.take<uint32_t>();
    block.bricks = 0;
  }
}

void MapReader::readColourIndex() {
  const PlacedSection* const section = file_.find(kColourIndex);
  contents_.painted = section != nullptr;
  if (section == nullptr) return;
  const Bytes bytes = file_.read(*section, kColourHeadBytes + block_count_ * kBlockBricksBytes);
  ByteReader in(bytes.data());
  for (float& gain : contents_.exposure) gain = in.take<float>();
  in.take<uint32_t>();
  for (MapBlock& block : contents_.blocks) block.bricks = in.take<uint64_t>();
}

void MapReader::readFree() {
  const PlacedSection* const section = file_.find(kFree);
  if (section == nullptr) return;
  const uint64_t bytes = section->header.content_bytes;
  if (bytes < kFreeHeadBytes || (bytes - kFreeHeadBytes) % kFreeRecordBytes != 0) {
    throwWrongSizes();
  }
  MapSize known;  // before it is read
  known.blocks = block_count_;
  known.voxel_arrays = array_count_;
  known.free_cubes = (bytes - kFreeHeadBytes) / kFreeRecordBytes;
  checkRoom(known);
  const Bytes content = file_.read(*section, bytes);
  ByteReader in(content.data());
  contents_.cell_voxels = in.take<int32_t>();
  if (contents_.cell_voxels == 0) throwWrongSizes();  // then there is no such section
  in.take<uint32_t>();
  contents_.free_cubes.resize(known.free_cubes);
  for (MapFreeCube& cube : contents_.free_cubes) {
    cube.key = in.takeKey();
    in.take<uint32_t>();
    for (uint64_t& word : cube.cells) word = in.take<uint64_t>();
  }
}

MapSize MapReader::checkedSize() const {
  MapSize size;
  checkSoundly([&] { size = sizeOf(contents_); });
  if (size.voxel_arrays != array_count_) throwWrongSizes();
  return size;
}

bool MapReader::skipsAnything() const {
  return std::any_of(file_.sections().begin(), file_.sections().end(),
                     [](const PlacedSection& section) { return !isKnown(section.header); });
}

void MapReader::checkHash(const ContentHash& hash) const {
  if (skipsAnything() || hash.result() == file_.contentHashInFile()) return;
  file_.throwDamaged("the content hash does not match");
}

template <class Check>
void MapReader::checkSoundly(const Check& check) const {
  std::string problem;
  try {
    check();
  } catch (const std::exception& error) {
    problem = error.what();
  }
  std::replace(problem.begin(), problem.end(), '\n', ' ');
  if (!problem.empty()) file_.throwDamaged(problem);
}

void MapReader::checkRoom(const MapSize& size) const {
  MapSize free, map = size;
  free.free_cubes = std::exchange(map.free_cubes, 0);
  const size_t bytes = limit_.adds_free ? size.bytes() : std::max(map.bytes(), free.bytes());
  if (bytes <= limit_.bytes) return;
  throw std::runtime_error("the map of '" + file_.path() + "' takes " +
                           std::to_string((bytes >> 20) + 1) + " MiB, and " +
                           std::to_string(limit_.bytes >> 20) +
                           " MiB are allowed; raise map/max_memory_mb (map_tool: "
                           "--max-memory-mb)");
}

std::vector<const PlacedSection*> MapReader::chunks(const char* id,
                                                    const ChunkBounds& bounds) const {
  std::vector<const PlacedSection*> sections = file_.all(id);
  if (sections.size() != bounds.count()) {
    file_.throwDamaged(std::string("it has too few or too many parts ") + id);
  }
  return sections;
}

template <class Word>
void MapReader::readChunk(const PlacedSection& section, const std::vector<size_t>& word_bounds,
                          size_t chunk, Word* words) const {
  const size_t count = word_bounds[chunk + 1] - word_bounds[chunk];
  file_.read(section, words + word_bounds[chunk], count * sizeof(Word));
}

template <class Word>
PlainArray<Word> MapReader::chunkOf(const PlacedSection& section,
                                    const std::vector<size_t>& word_bounds, size_t chunk) const {
  PlainArray<Word> words(word_bounds[chunk + 1] - word_bounds[chunk]);
  file_.read(section, words.data(), words.size() * sizeof(Word));
  return words;
}

void MapReader::findBounds(MapInfo& info) const {
  if (contents_.blocks.empty()) return;
  info.least = info.most = contents_.blocks.front().key;
  for (const MapBlock& block : contents_.blocks) {
    info.least = leastOf(info.least, block.key);
    info.most = greatestOf(info.most, block.key);
  }
}

void MapReader::listParts(MapInfo& info) const {
  for (const PlacedSection& section : file_.sections()) {
    const SectionHeader& header = section.header;
    auto part = std::find_if(info.parts.begin(), info.parts.end(),
                             [&](const MapFilePart& p) { return p.id == header.name(); });
    if (part == info.parts.end()) {
      info.parts.push_back({header.name(), header.isRequired(), isKnown(header)});
      part = info.parts.end() - 1;
    }
    ++part->sections;
    part->stored_bytes += header.stored_bytes;
    part->content_bytes += header.content_bytes;
  }
}

}  // namespace map_format

using namespace map_format;

MapContents loadMap(const std::string& path, size_t max_bytes, int threads) {
  return MapReader(path, {max_bytes, true}).load(threads);
}

MapContents loadMap(const std::string& path, const MapperParams& params, int threads) {
  const MapLimit limit{static_cast<size_t>(params.map.max_memory_mb) << 20, params.space.enabled};
  return MapReader(path, limit).load(threads);
}

MapInfo readMapInfo(const std::string& path) { return MapReader(path, MapLimit()).info(); }

}  // namespace dtsdf
