/// A map in parts, for maps that are larger than memory.
#pragma once

#include <functional>
#include <memory>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// A map whose voxels and colours are delivered in parts.
struct MapParts {
  std::shared_ptr<const MapContents> head;  ///< The contents without voxels and colours.
  /// Calls `take` with one part after the other: the next blocks in the head's order, with their
  /// voxels and colours. Calls may come from several threads, one at a time.
  std::function<void(const std::function<void(const MapContents& part)>& take)> visit;
};

/// checkContents() of a head. @throws std::runtime_error that says what is wrong.
void checkHead(const MapContents& head);

/// makeMapper() from the contents of another mapper, part by part: with map/page_folder the map may
/// be larger than map/max_memory_mb.
/// @throws std::runtime_error as makeMapper() does, and what `visit` throws.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params, const MapParts& parts);

}  // namespace dtsdf
