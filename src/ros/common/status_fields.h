/// Helpers for writing the status: problems, memory, counts.
#pragma once

#include <dtsdf_mapping/MapStatus.h>

#include <cstdint>
#include <string>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

using dtsdf_mapping::MapStatus;

/// Sets level, code and message, unless a more important problem was reported before: one with a
/// higher level, or with the same level and a code that is not larger. MAPPING is the least
/// important code.
inline void report(MapStatus& status, uint8_t level, uint8_t code, const std::string& message) {
  const bool is_first = status.code == MapStatus::MAPPING || code < status.code;
  if (level < status.level || (level == status.level && !is_first)) return;
  status.level = level;
  status.code = code;
  status.message = message;
}

/// Values of MemoryPart.place, besides "disk".
constexpr char kHost[] = "host", kGpu[] = "gpu";

/// Adds a part of the memory, or adds to the part that has this name and place.
inline void addMemory(MapStatus& status, const char* name, const char* place, uint64_t bytes,
                      uint64_t limit_bytes = 0) {
  dtsdf_mapping::MemoryPart part;
  part.name = name;
  part.place = place;
  part.bytes = bytes;
  part.limit_bytes = limit_bytes;
  for (dtsdf_mapping::MemoryPart& same : status.memory) {
    if (same.name != part.name || same.place != part.place) continue;
    same.bytes += bytes;
    return;
  }
  status.memory.push_back(part);
}

/// Adds pages (data moved to disk) and their index in memory, and reports lost pages.
inline void addPages(MapStatus& status, const PageStats& pages, const std::string& what) {
  status.page_failures += pages.failures;
  if (pages.lost > 0) {
    report(status, MapStatus::WARN, MapStatus::PAGES_LOST,
           std::to_string(pages.lost) + " " + what + " could not be read back: " + pages.problem);
  }
  const size_t bytes = pages.bytes + pages.space_bytes;
  if (bytes == 0) return;
  addMemory(status, "page_index", kHost, pages.index_bytes);
  addMemory(status, "pages", "disk", bytes);
}

}  // namespace dtsdf
