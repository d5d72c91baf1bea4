#include "io/map_chunks.h"

#include <utility>

#include "io/map_reader.h"

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

}  // namespace dtsdf
