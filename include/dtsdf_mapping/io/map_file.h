/// Saves and loads maps as .dtsdf files; docs/map_format.md describes the format byte by byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "dtsdf_mapping/map_contents.h"

namespace dtsdf {

/// Usual extension of map files; saveMap() accepts any extension.
constexpr char kMapExtension[] = ".dtsdf";

/// Summary of a map file.
struct MapInfo : MapHead {
  MapSize size;                ///< Size of the map.
  uint64_t file_bytes = 0;     ///< Length of the file.
  uint64_t content_hash = 0;   ///< Hash stored in the file: see contentHash().
  BlockKey least = {0, 0, 0};  ///< Smallest block coordinate per axis; 0 if the map is empty.
  BlockKey most = {0, 0, 0};   ///< Largest block coordinate per axis; 0 if the map is empty.
};

/// Saves a map. Writes a temporary file in the same folder and renames it; creates missing folders.
/// Equal contents give equal bytes, with any number of threads (0: all cores).
/// @return Head and bounds of the map, and length and hash of the file.
/// @throws std::runtime_error for contents that checkContents() rejects, or a file that cannot be
/// written; the message names the path and says what to do. An existing file then stays intact.
MapInfo saveMap(const MapContents& contents, const std::string& path, int threads = 0);

/// No limit on a map's size in memory.
constexpr size_t kNoMapLimit = std::numeric_limits<size_t>::max();

/// Loads a map and verifies its checksums. Sizes are checked against the file's length and the
/// limit before memory is allocated: a map of more than `max_bytes` (MapSize::bytes()) is refused.
/// @throws std::runtime_error with one sentence that names the path and says what to do.
MapContents loadMap(const std::string& path, size_t max_bytes = kNoMapLimit, int threads = 0);

/// Loads a map for a mapper with these settings; the limit is maxMapBytes(). Free cells count
/// towards it even if the mapper ignores them because space/enabled is off.
MapContents loadMap(const std::string& path, const MapperParams& params, int threads = 0);

/// Reads a map file except for its voxels and colours, so damage to these goes unnoticed.
/// @throws std::runtime_error as loadMap() does.
MapInfo readMapInfo(const std::string& path);

/// Hash of a map: its bound settings, blocks, voxels, colours, exposure, free cells and frame
/// counts. Equal maps have equal hashes, whatever their file, backend or map frame. XXH64;
/// docs/map_format.md lists the bytes. @throws std::runtime_error for contents that saveMap() would
/// reject.
uint64_t contentHash(const MapContents& contents, int threads = 0);

}  // namespace dtsdf
