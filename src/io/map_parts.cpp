#include "io/map_parts.h"

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "params/printable.h"

namespace dtsdf {

MapParts partsOf(std::shared_ptr<const MapChunks> file) {
  MapParts parts;
  parts.head = std::shared_ptr<const MapContents>(file, &file->head());
  parts.visit = [file = std::move(file)](const auto& take) { file->visit(take); };
  return parts;
}

void copyMapFile(const MapChunks& file, const std::string& path) {
  std::error_code error;
  std::filesystem::copy_file(file.path(), path, error);
  const std::string what =
      "the map of '" + printable(file.path()) + "' cannot be copied to '" + printable(path) + "': ";
  if (error) throw std::runtime_error(what + error.message());
  if (readMapInfo(path).content_hash == file.contentHash()) return;
  throw std::runtime_error(what + "it has changed since it was opened");
}

}  // namespace dtsdf
