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
/// Equal contents give identical files, with any number of threads (0: all cores).
/// @return The map's head and bounds, and the file's length and hash.
/// @throws std::runtime_error for contents that checkContents() rejects, or a file that cannot be
/// written; the message names the path and says what to do. In that case, an existing file stays
/// intact.
MapInfo saveMap(const MapContents& contents, const std::string& path, int threads = 0);

/// No limit on a map's size in memory.
constexpr size_t kNoMapLimit = std::numeric_limits<size_t>::max();

/// Loads a map and verifies its checksums. A map of more than `max_bytes` (MapSize::bytes()) is
/// refused. Sizes are checked against this limit and the length of the file before memory is
/// allocated.
/// @throws std::runtime_error with one sentence that names the path and says what to do.
MapContents loadMap(const std::string& path, size_t max_bytes = kNoMapLimit, int threads = 0);

/// Loads a map for a mapper with these settings; the limit is maxMapBytes(). Free cells count
/// towards the limit even if space/enabled is false and the mapper ignores them.
MapContents loadMap(const std::string& path, const MapperParams& params, int threads = 0);

/// Reads a map file without its voxels and colours, so damage to these goes unnoticed.
/// @throws std::runtime_error as loadMap() does.
MapInfo readMapInfo(const std::string& path);

/// XXH64 hash over the settings that withSettingsOf() copies, and over the map's blocks, voxels,
/// colours, exposure, free cells and frame counts; docs/map_format.md lists the bytes. Equal maps
/// have equal hashes, regardless of file, backend and map frame. @throws std::runtime_error for
/// contents that saveMap() would reject.
uint64_t contentHash(const MapContents& contents, int threads = 0);

}  // namespace dtsdf
