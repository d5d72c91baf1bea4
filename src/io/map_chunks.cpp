#include "io/map_chunks.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "io/map_reader.h"
#include "params/printable.h"

namespace dtsdf {

using namespace map_format;

struct MapChunks::State {
  State(const std::string& path, const MapLimit& limit)
      : reader(path, limit),
        bounds(reader.bounds()),
        voxels(reader.voxelChunks()),
        colours(reader.colourChunks()) {}

  template <class Word>
  void read(const PlacedSection& section, const std::vector<size_t>& word_bounds, size_t chunk,
            std::vector<Word>& words) const {
    words.resize(word_bounds[chunk + 1] - word_bounds[chunk]);
    reader.file().read(section, words.data(), words.size() * sizeof(Word));
  }

  const MapReader reader;
  const ChunkBounds bounds;
  const std::vector<const PlacedSection*> voxels, colours;
};

MapChunks::MapChunks(const std::string& path)
    : state_(std::make_unique<const State>(path, MapLimit())) {}

MapChunks::MapChunks(const std::string& path, const MapperParams& params)
    : state_(std::make_unique<const State>(path,
                                           MapLimit{mostMapBytes(params), params.space.enabled})) {}

MapChunks::~MapChunks() = default;
MapChunks::MapChunks(MapChunks&&) noexcept = default;

const std::string& MapChunks::path() const { return state_->reader.file().path(); }
const MapContents& MapChunks::head() const { return state_->reader.head(); }
uint64_t MapChunks::contentHash() const { return state_->reader.file().contentHashInFile(); }
size_t MapChunks::count() const { return state_->bounds.count(); }

void MapChunks::readVoxels(size_t chunk, std::vector<uint64_t>& words) const {
  state_->read(*state_->voxels[chunk], state_->bounds.voxel_word, chunk, words);
}

void MapChunks::readColours(size_t chunk, std::vector<uint32_t>& words) const {
  state_->read(*state_->colours[chunk], state_->bounds.colour_word, chunk, words);
}

void MapChunks::visit(const std::function<void(const MapContents&)>& take) const {
  state_->reader.visit(take);
}

MapParts partsOf(std::shared_ptr<const MapChunks> file) {
  MapParts parts;
  parts.head = std::shared_ptr<const MapContents>(file, &file->head());
  parts.visit = [file = std::move(file)](const auto& take) { file->visit(take); };
  return parts;
}

void copyMapFile(const MapChunks& file, const std::string& path) {
  std::error_code error;
  std::filesystem::copy_file(file.path(), path, error);
  const std::string what =
      "the map of '" + printable(file.path()) + "' cannot be copied to '" + printable(path) + "': ";
  if (error) throw std::runtime_error(what + error.message());
  if (readMapInfo(path).content_hash == file.contentHash()) return;
  throw std::runtime_error(what + "it has changed since it was opened");
}

namespace {

/// The blocks of a chunk, with what they hold.
MapContents chunkOf(Mapper& mapper, const MapContents& outline, size_t chunk) {
  const auto at = [&](size_t chunks) {
    const size_t block = std::min(outline.blocks.size(), chunks * kBlocksPerMapChunk);
    return outline.blocks.begin() + static_cast<std::ptrdiff_t>(block);
  };
  return mapper.part(std::vector<MapBlock>(at(chunk), at(chunk + 1)));
}

SavedMap saveInChunks(Mapper& mapper, const MapContents& outline, const std::string& path) {
  MapContents part;
  MapWords words;
  words.voxels = [&](size_t chunk) {
    part = chunkOf(mapper, outline, chunk);
    return part.voxels.data();
  };
  words.colours = [&](size_t chunk) {
    part = chunkOf(mapper, outline, chunk);
    return part.colours.data();
  };
  return saveMapInChunks(outline, words, path, 1);
}

MapContents outlineWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents outline = mapper.outline();
  static_cast<MapOrigin&>(outline) = origin;
  return outline;
}

}  // namespace

MapContents contentsWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents contents = mapper.contents();
  static_cast<MapOrigin&>(contents) = origin;
  return contents;
}

SavedMap saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path) {
  if (mapper.stats().pages.blocks == 0) return saveMap(contentsWith(origin, mapper), path);
  for (;;) {  // once more without blocks that turn out to be damaged
    const uint64_t lost = mapper.stats().pages.lost;
    const SavedMap saved = saveInChunks(mapper, outlineWith(origin, mapper), path);
    if (mapper.stats().pages.lost == lost) return saved;
  }
}

SavedMap savePartOf(Mapper& mapper, const MapOrigin& origin,
                    const std::function<bool(const BlockKey&)>& is_in, const std::string& path) {
  MapContents outline = outlineWith(origin, mapper);
  auto& blocks = outline.blocks;
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(),
                              [&](const MapBlock& block) { return !is_in(block.key); }),
               blocks.end());
  return saveInChunks(mapper, outline, path);
}

}  // namespace dtsdf
