#include <algorithm>

#include "backend/mapper_probe.h"
#include "map/block_table.h"

namespace dtsdf {

MapperMemory ProbedMapper::memory() const {
  MapperMemory sums;
  size_t index_bytes = 0;
  for (const MemoryPart& part : memoryParts()) {
    switch (part.kind) {
      case MemoryKind::kMap:
        sums.spare += part.reserved_bytes - std::min(part.used_bytes, part.reserved_bytes);
        break;
      case MemoryKind::kIndices: index_bytes += part.reserved_bytes; break;
      case MemoryKind::kMesh: sums.meshes += part.reserved_bytes; break;
      case MemoryKind::kScratch: sums.scratch += part.reserved_bytes; break;
      case MemoryKind::kSpace: sums.space += part.reserved_bytes; break;
      case MemoryKind::kStaging:
        sums.on_gpu = true;  // nothing else needs any
        sums.staging += part.reserved_bytes;
        break;
    }
  }
  const size_t counted_bytes = stats().blocks * BlockTable::kBlockBytes;
  sums.indices = index_bytes - std::min(index_bytes, counted_bytes);
  return sums;
}

}  // namespace dtsdf
