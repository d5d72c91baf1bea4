/// Maps in pieces, for those that are larger than memory: map files chunk by chunk, and what a
/// mapper has, saved at once or piece by piece.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/map_parts.h"
#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// A file has the blocks of a map in chunks of so many, the last one what is left.
constexpr size_t kBlocksPerMapChunk = 256;

/// Where the words of a map come from: of the blocks of chunk i, in their order. Of a pointer, so
/// many words are read as MapContents has for these blocks.
struct MapWords {
  std::function<const uint64_t*(size_t chunk)> voxels;
  std::function<const uint32_t*(size_t chunk)> colours;  ///< Not called if nothing was painted.
};

/// saveMap() of a map whose voxels and colours come chunk by chunk: first all voxels, then all
/// colours. `head` is the map without them. With one thread the chunks are asked for one at a time,
/// by rising numbers, and the words of one have to last until the next is asked for.
/// @throws std::runtime_error as saveMap()
SavedMap saveMapInChunks(const MapContents& head, const MapWords& words, const std::string& path,
                         int threads);

/// An open map file. Its headers and blocks are checked when it is opened, and each chunk against
/// its checksum when it is read.
class MapChunks {
 public:
  /// @throws std::runtime_error as loadMap()
  explicit MapChunks(const std::string& path);
  /// Of no more than a mapper of these settings may hold, in memory and on disk.
  MapChunks(const std::string& path, const MapperParams& params);
  ~MapChunks();
  MapChunks(MapChunks&&) noexcept;

  const std::string& path() const;

  /// The map without voxels and colours.
  const MapContents& head() const;
  uint64_t contentHash() const;  ///< As it stands in the file.

  size_t count() const;

  /// The words of a chunk's blocks. @throws std::runtime_error for a damaged file
  void readVoxels(size_t chunk, std::vector<uint64_t>& words) const;
  void readColours(size_t chunk, std::vector<uint32_t>& words) const;

  /// Calls `take` with one chunk after the other, from several threads in turn, and compares the
  /// content hash at the end.
  /// @throws std::runtime_error for a damaged file, and what `take` throws.
  void visit(const std::function<void(const MapContents& part)>& take) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

/// The map of an open file: its parts are chunks, read when they are asked for, and checked as
/// loadMap() does.
MapParts partsOf(std::shared_ptr<const MapChunks> file);

/// Copies the file that an open one was opened from.
/// @throws std::runtime_error where it cannot be copied, or is another map by now.
void copyMapFile(const MapChunks& file, const std::string& path);

/// contents(), and what the mapper does not know.
MapContents contentsWith(const MapOrigin& origin, Mapper& mapper);

/// @throws std::runtime_error as saveMap() does, and where blocks on disk cannot be read.
SavedMap saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path);

/// Saves those blocks of a map, piece by piece, and all free cells.
/// @throws As saveMapOf() does.
SavedMap savePartOf(Mapper& mapper, const MapOrigin& origin,
                    const std::function<bool(const BlockKey&)>& is_in, const std::string& path);

}  // namespace dtsdf
