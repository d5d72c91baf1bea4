/// A map that is read or written in parts because it may be larger than memory.
#pragma once

#include <functional>
#include <memory>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// A map whose voxels and colours are delivered in parts.
struct MapParts {
  std::shared_ptr<const MapContents> head;  ///< The contents without voxels and colours.
  /// Calls `take` for one part after another. Each part contains some of the blocks listed in the
  /// head, sorted by packed key, with their voxels and colours; no block is in two parts. `take`
  /// may be called from different threads, but never concurrently.
  std::function<void(const std::function<void(const MapContents& part)>& take)> visit;
};

/// Like checkContents(), but for contents without voxels and colours. @throws std::runtime_error
/// that says what is wrong.
void checkHead(const MapContents& head);

/// Creates a mapper from the contents of another mapper, part by part. With map/page_folder, the
/// map may be larger than map/max_memory_mb.
/// @throws std::runtime_error like makeMapper(params, contents), and any error that `visit` throws.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params, const MapParts& parts);

}  // namespace dtsdf
