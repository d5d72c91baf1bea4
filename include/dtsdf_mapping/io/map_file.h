/// Saves and loads maps as .dtsdf files; docs/map_format.md describes them byte by byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "dtsdf_mapping/map_contents.h"

namespace dtsdf {

/// The extension of map files, for programs that check names; saveMap() takes any.
constexpr char kMapExtension[] = ".dtsdf";

/// What is in a map file, except voxels and colours.
struct MapInfo : MapHead {
  MapSize size;                ///< Size of the map.
  uint64_t file_bytes = 0;     ///< Length of the file.
  uint64_t content_hash = 0;   ///< As it stands in the file: see contentHash().
  BlockKey least = {0, 0, 0};  ///< Smallest block coordinates; 0 for an empty map.
  BlockKey most = {0, 0, 0};   ///< Largest block coordinates; 0 for an empty map.
};

/// Saves a map. Equal contents give equal bytes, with any number of threads (0: all cores). The
/// file is written beside the old one and renamed; missing folders are made.
/// @return Head and bounds of the contents, and length and hash of the file.
/// @throws std::runtime_error for contents that checkContents() refuses, or a file that cannot be
/// written; the text names the path and says what to do. The old file is whole then.
MapInfo saveMap(const MapContents& contents, const std::string& path, int threads = 0);

/// No limit to what a map takes in memory.
constexpr size_t kNoMapLimit = std::numeric_limits<size_t>::max();

/// Loads a map. Everything is checked against its checksum. Sizes are checked against the file and
/// the limit before memory is allocated: a map of more than `max_bytes` (MapSize::bytes()) is
/// refused.
/// @throws std::runtime_error with one sentence that names the path and says what to do.
MapContents loadMap(const std::string& path, size_t max_bytes = kNoMapLimit, int threads = 0);

/// Loads a map for a mapper with these settings, within its map/max_memory_mb. Free cells count
/// only with space/enabled, as a mapper takes them over only then; otherwise they may take as much
/// again while the map is loaded.
MapContents loadMap(const std::string& path, const MapperParams& params, int threads = 0);

/// Reads a map file except its voxels and colours, so damage to these goes
/// unnoticed.
/// @throws std::runtime_error as loadMap() does.
MapInfo readMapInfo(const std::string& path);

/// A hash of the map itself, equal for equal maps whatever file, backend or frame they are from: of
/// the settings that it is bound to, blocks, voxels, colours, and frames fused. XXH64;
/// docs/map_format.md says of which bytes.
uint64_t contentHash(const MapContents& contents, int threads = 0);

}  // namespace dtsdf
