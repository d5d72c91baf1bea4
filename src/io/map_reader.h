/// What is in a map file: first what the small sections say, then sizes, then what there is room
/// for.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "io/map_chunks.h"
#include "io/map_format.h"
#include "io/map_sections.h"

namespace dtsdf {
namespace map_format {

/// What a map may take.
struct MapLimit {
  size_t bytes = kNoMapLimit;
  bool adds_free = true;  ///< Whether what was seen free counts too, or has the same limit alone.
};

/// Has read the small sections and the blocks of a file; voxels and colours as it is asked.
class MapReader {
 public:
  MapReader(const std::string& path, MapLimit limit);

  MapContents load(int threads);

  /// Calls `take` with one chunk after the other, as contents of their own.
  void visit(const std::function<void(const MapContents&)>& take) const;

  /// What is needed to read chunk by chunk.
  const MapFile& file() const { return file_; }
  const MapContents& head() const { return contents_; }
  ChunkBounds bounds() const { return boundsOf(contents_.blocks, blocks_per_chunk_); }
  std::vector<const PlacedSection*> voxelChunks() const { return chunks(kVoxels, bounds()); }
  std::vector<const PlacedSection*> colourChunks() const;

  MapInfo info();

 private:
  void readSettings();
  void readState();
  /// By the headers, which are sound by now: bounded by what the file stores.
  uint64_t voxelBytes() const;

  [[noreturn]] void throwWrongSizes() const { file_.throwDamaged("its sizes are inconsistent"); }

  void readBlocks();
  void readColourIndex();
  void readFree();

  MapSize checkedSize() const;

  /// Whether the file has something that this reader does not know, without which the hash of the
  /// map may be another one.
  bool skipsAnything() const;

  void checkHash(const ContentHash& hash) const;
  /// What is found to be wrong with the contents is wrong with the file.
  template <class Check>
  void checkSoundly(const Check& check) const;

  void checkRoom(const MapSize& size) const;

  std::vector<const PlacedSection*> chunks(const char* id, const ChunkBounds& bounds) const;

  template <class Word>
  void readChunk(const PlacedSection& section, const std::vector<size_t>& word_bounds, size_t chunk,
                 Word* words) const;

  template <class Word>
  PlainArray<Word> chunkOf(const PlacedSection& section, const std::vector<size_t>& word_bounds,
                           size_t chunk) const;

  void findBounds(MapInfo& info) const;
  void listParts(MapInfo& info) const;

  MapFile file_;
  const MapLimit limit_;
  uint64_t block_count_ = 0, array_count_ = 0, blocks_per_chunk_ = 0;
  MapContents contents_;
  MapSize size_;
};

}  // namespace map_format
}  // namespace dtsdf
