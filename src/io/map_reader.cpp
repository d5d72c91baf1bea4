// loadMap() and readMapInfo().
#include "io/map_reader.h"

namespace dtsdf {

using namespace map_format;

MapContents loadMap(const std::string& path, size_t max_bytes, int threads) {
  return MapReader(path, {max_bytes, true}).load(threads);
}

MapContents loadMap(const std::string& path, const MapperParams& params, int threads) {
  const MapLimit limit{static_cast<size_t>(params.map.max_memory_mb) << 20, params.space.enabled};
  return MapReader(path, limit).load(threads);
}

MapInfo readMapInfo(const std::string& path) { return MapReader(path, MapLimit()).info(); }

}  // namespace dtsdf
