/// Maps in pieces: map files chunk by chunk, and what a mapper has, saved piece by piece.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/map_parts.h"
#include "dtsdf_mapping/mapper.h"
#include "io/map_box.h"
#include "io/records.h"

namespace dtsdf {

/// A file has the voxels and colours of so many blocks in a chunk, the last one of what is left.
constexpr size_t kBlocksPerChunk = 256;
size_t chunkCount(const std::vector<MapBlock>& blocks);
std::vector<MapBlock> blocksOfChunk(const std::vector<MapBlock>& blocks, size_t chunk);

/// Voxels and colours of a chunk. Called one at a time, by numbers that rise more or less, from
/// several threads.
using ReadChunk = std::function<MapContents(size_t chunk)>;

/// What the head of a map says of its file, but for length and hash.
MapInfo infoOf(const MapContents& head);

/// Writes the records of a map whose voxels and colours come chunk by chunk; `head` is the map
/// without them. @throws std::runtime_error for what a reader would refuse, before it writes.
MapInfo writeMap(const MapContents& head, const ReadChunk& read, RecordWriter& out, int threads = 0,
                 const MapBox* box = nullptr);

/// Saves such a map as a file. @throws std::runtime_error as saveMap()
MapInfo saveMapInChunks(const MapContents& head, const ReadChunk& read, const std::string& path,
                        int threads = 0, const MapBox* box = nullptr);

/// A map in an open file. Its structure and small records are checked at once, and each chunk
/// against its checksum when it is read.
class MapChunks {
 public:
  /// @param adds_free Whether what was seen free counts too, or has the same limit alone.
  /// @throws std::runtime_error as loadMap()
  explicit MapChunks(const std::string& path, size_t most_bytes = kNoMapLimit,
                     bool adds_free = true);
  /// For a mapper of these settings: what it may hold, in memory and on disk.
  MapChunks(const std::string& path, const MapperParams& params);
  /// A map among the records of a file, from this one on.
  MapChunks(std::shared_ptr<const RecordFile> file, size_t first, size_t most_bytes = kNoMapLimit,
            bool adds_free = true);

  const std::string& path() const { return file_->path(); }

  /// The map without voxels and colours.
  const MapContents& head() const { return head_; }
  const std::optional<MapBox>& box() const { return box_; }  ///< None: it is whole.
  const MapSize& size() const { return size_; }
  uint64_t contentHash() const { return content_hash_; }  ///< As it stands in the file.
  size_t endRecord() const { return end_ + 1; }           ///< That after its last one.

  /// The blocks of a chunk, their voxels and colours. @throws std::runtime_error for a damaged file
  MapContents part(size_t chunk) const;

  /// Calls `take` with one chunk after the other, from several threads in turn.
  /// @throws std::runtime_error for a damaged file, and what `take` throws.
  void visit(const std::function<void(const MapContents& part)>& take, int threads = 0) const;

  MapInfo info() const;

 private:
  [[noreturn]] void throwWrongSizes() const;
  template <class Check>
  void soundly(const Check& check) const;
  void findRecords();
  void checkEnd();
  const Record* find(const char* kind) const;
  const Record& get(const char* kind) const;
  void readSettings();
  void readTables();
  void readBlocks(size_t count);
  void readColourIndex();
  void readFree(MapSize known);
  void checkRoom(const MapSize& taken) const;
  template <class Word>
  void readWords(const Record& record, uint64_t sum, size_t count, PlainArray<Word>& words) const;

  const std::shared_ptr<const RecordFile> file_;
  const size_t most_bytes_;
  const bool adds_free_;
  const size_t first_;  ///< Record, and that of the end.
  size_t end_ = 0;
  MapContents head_;
  std::optional<MapBox> box_;
  MapSize size_;
  uint64_t content_hash_ = 0;
  std::vector<uint64_t> sums_;            ///< Checksums of voxels, and colours, chunk by chunk.
  std::vector<Record> voxels_, colours_;  ///< Copies: a journal grows while its map is read.
};

/// The map of an open file: its parts are chunks, read when they are asked for.
MapParts partsOf(std::shared_ptr<const MapChunks> file);

/// contents(), and what the mapper does not know.
MapContents contentsWith(const MapOrigin& origin, Mapper& mapper);

/// Saves a mapper's map piece by piece.
/// @throws std::runtime_error as saveMap() does, and where blocks on disk cannot be read.
MapInfo saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path);

/// Saves those of its blocks that lie in a box, and all free cells, in the same way.
MapInfo saveBoxOf(Mapper& mapper, const MapOrigin& origin, const MapBox& box,
                  const std::string& path);

}  // namespace dtsdf
