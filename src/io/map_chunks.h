/// Reads and writes map files chunk by chunk, and saves a mapper's map without copying all of it.
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

/// Number of blocks in a chunk; the last chunk of a file may have fewer.
constexpr size_t kBlocksPerChunk = 256;
size_t chunkCount(const std::vector<MapBlock>& blocks);
std::vector<MapBlock> blocksOfChunk(const std::vector<MapBlock>& blocks, size_t chunk);

/// Returns the voxels and colours of a chunk. Called from several threads, but never concurrently,
/// and in roughly ascending order of chunks.
using ReadChunk = std::function<MapContents(size_t chunk)>;

/// The MapInfo of a map, without the file size and the content hash.
MapInfo infoOf(const MapContents& head);

/// Writes the records of a map: voxels and colours from `read`, everything else from `head`.
/// @throws std::runtime_error, before writing anything, if readers would reject the map.
MapInfo writeMap(const MapContents& head, const ReadChunk& read, RecordWriter& out, int threads = 0,
                 const MapBox* box = nullptr);

/// Writes a map file; see writeMap(). @throws std::runtime_error like saveMap()
MapInfo saveMapInChunks(const MapContents& head, const ReadChunk& read, const std::string& path,
                        int threads = 0, const MapBox* box = nullptr);

/// A map in an open file. Opening it checks its structure and small records; each chunk is checked
/// when it is read.
class MapChunks {
 public:
  /// @throws std::runtime_error like loadMap()
  explicit MapChunks(const std::string& path, size_t max_bytes = kNoMapLimit);
  /// Opens a map, which must not exceed the memory and disk limits in `params`.
  MapChunks(const std::string& path, const MapperParams& params);
  /// Reads a map from a record file, starting at record `first`.
  MapChunks(std::shared_ptr<const RecordFile> file, size_t first, size_t max_bytes = kNoMapLimit);

  const std::string& path() const { return file_->path(); }

  /// The map without voxels and colours.
  const MapContents& head() const { return head_; }
  const std::optional<MapBox>& box() const { return box_; }  ///< std::nullopt for a whole map.
  const MapSize& size() const { return size_; }
  uint64_t contentHash() const { return content_hash_; }  ///< As stored in the file.
  size_t endRecord() const { return end_ + 1; }           ///< Index of the record after the map.

  /// The blocks of a chunk, with voxels and colours.
  /// @throws std::runtime_error if the file is damaged.
  MapContents part(size_t chunk) const;

  /// Calls `take` with each chunk in order, from several threads, but never concurrently.
  /// @throws std::runtime_error if the file is damaged; exceptions from `take` are passed on.
  void visit(const std::function<void(const MapContents& part)>& take, int threads = 0) const;

  MapInfo info() const;

 private:
  template <class Check>
  void reportingDamage(const Check& check) const;
  void findRecords();
  void checkEnd();
  const Record* find(const char* kind) const;
  const Record& get(const char* kind) const;
  void readSettings();
  void readTables();
  void checkRoom(const MapSize& taken) const;
  template <class Word>
  void readWords(const Record& record, uint64_t sum, size_t count, PlainArray<Word>& words) const;

  const std::shared_ptr<const RecordFile> file_;
  const size_t max_bytes_;
  const size_t first_;  ///< First record of the map; `end_` is its last.
  size_t end_ = 0;
  MapContents head_;
  std::optional<MapBox> box_;
  MapSize size_;
  uint64_t content_hash_ = 0;
  std::vector<uint64_t> sums_;            ///< Checksums of each chunk's voxels and colours.
  std::vector<Record> voxels_, colours_;  ///< Copies, since RecordFile::records() may grow.
};

/// The map in an open file as MapParts. Its chunks are read on demand.
MapParts partsOf(std::shared_ptr<const MapChunks> file);

/// A mapper's contents with `origin` filled in.
MapContents contentsWith(const MapOrigin& origin, Mapper& mapper);

/// Saves a mapper's map chunk by chunk.
/// @throws std::runtime_error like saveMap(), or if blocks on disk cannot be read.
MapInfo saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path);

/// Saves the blocks of a mapper's map that lie in a box, and all cells of the free-space grid.
MapInfo saveBoxOf(Mapper& mapper, const MapOrigin& origin, const MapBox& box,
                  const std::string& path);

}  // namespace dtsdf
