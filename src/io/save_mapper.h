/// Saves the map of a mapper: at once, or piece by piece where some of it lies on disk.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// What a mapper does not know of its map.
struct MapOrigin {
  std::string map_frame;
  std::optional<Eigen::Isometry3d> T_W_M;
  double stamp_s = 0.0;  ///< Of the newest frame.
};

/// contents(), and what the mapper does not know.
MapContents contentsWith(const MapOrigin& origin, Mapper& mapper);

/// @throws std::runtime_error as saveMap() does, and where blocks on disk cannot be read.
SavedMap saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path);

/// Saves those blocks of a map, piece by piece, and all free cells.
/// @throws As saveMapOf() does.
SavedMap savePartOf(Mapper& mapper, const MapOrigin& origin,
                    const std::function<bool(const BlockKey&)>& is_in, const std::string& path);

}  // namespace dtsdf
