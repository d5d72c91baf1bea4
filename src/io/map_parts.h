/// Map files part by part, for maps that are larger than memory.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/map_parts.h"
#include "io/map_chunks.h"

namespace dtsdf {

/// The map of an open file: its parts are chunks, read when they are asked for, and checked as
/// loadMap() does.
MapParts partsOf(std::shared_ptr<const MapChunks> file);

/// Copies the file that an open one was opened from.
/// @throws std::runtime_error where it cannot be copied, or is another map by now.
void copyMapFile(const MapChunks& file, const std::string& path);

}  // namespace dtsdf
