/// Computes the distances from cells to surfaces on the device.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "kernels/space/squared_distances.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// Memory for the squared distances of a sector (32 x 32 x 32 cells): pinned host memory, which
/// kernels write directly, and a copy on the device, with which they compare new values.
struct SquaresPlace {
  uint16_t *host, *device;
  bool is_new;  ///< Whether it is still uninitialised.
};

class SquaresPool : public std::enable_shared_from_this<SquaresPool> {
 public:
  /// Memory for the squared distances of a sector. If `squares` was not allocated from a pool, it
  /// is replaced by uninitialised memory from this pool, which stays alive as long as that memory
  /// is in use.
  SquaresPlace placeOf(std::shared_ptr<uint16_t[]>& squares);

  /// Whether the pool can provide memory for all `squares` without exceeding `most_bytes`.
  bool hasRoomFor(const std::vector<std::shared_ptr<uint16_t[]>>& squares, size_t most_bytes) const;

  size_t bytes() const;      ///< Memory used on the host; as much is used on the device.
  size_t freeBytes() const;  ///< The unused part of bytes().

 private:
  static constexpr size_t kChunkSectors = 16;
  static constexpr size_t kChunkSquares = kChunkSectors * kCellsPerSector;

  struct GiveBack {
    std::shared_ptr<SquaresPool> pool;
    uint16_t* device;
    void operator()(uint16_t* host) const noexcept;
  };
  SquaresPlace take();
  void grow();

  mutable std::mutex mutex_;  ///< Memory may be returned on any thread.
  std::vector<std::pair<PinnedBuffer<uint16_t>, DeviceBuffer<uint16_t>>> chunks_;
  std::vector<SquaresPlace> free_;  ///< Has capacity for all entries: freeing never allocates.
};

class DistanceComputer {
 public:
  /// @param most_bytes Maximum memory for squared distances, on the device and on the host each.
  explicit DistanceComputer(size_t most_bytes) : max_bytes_(most_bytes) {}
  ~DistanceComputer() { stream_.drain(); }

  /// Implements DistanceWork on its own stream. @return false if the limit would be exceeded.
  /// @throws BackendError if CUDA fails.
  bool make(const DistanceTask& task, std::vector<std::shared_ptr<uint16_t[]>>& squares);

  void addMemory(MapperMemory& memory) const;

 private:
  DistanceTask upload(const DistanceTask& task, const SquaresPlace*& results);

  const size_t max_bytes_;
  Stream stream_;
  std::shared_ptr<SquaresPool> pool_ = std::make_shared<SquaresPool>();
  PinnedBuffer<char> staged_;
  DeviceBuffer<char> task_;
  DeviceBuffer<uint16_t> planes_;
  std::vector<SquaresPlace> results_;
  PinnedBuffer<uint32_t> is_near_;
};

}  // namespace gpu
}  // namespace dtsdf
