/// Distances between cells of space, computed on the device.
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

/// Memory for the squared distances of a sector: pinned host memory, which kernels write directly,
/// and a copy on the device to compare with.
struct SquaresPlace {
  uint16_t *host, *device;
  bool is_new;  ///< Not filled yet.
};

class SquaresPool : public std::enable_shared_from_this<SquaresPool> {
 public:
  /// The memory of a sector's squares. If it was not allocated from a pool, memory from this pool
  /// replaces it, without its contents. The pool lives at least as long as memory allocated from
  /// it.
  SquaresPlace placeOf(std::shared_ptr<uint16_t[]>& squares);

  /// Whether `most_bytes` are enough for pool memory for all `squares`.
  bool hasRoomFor(const std::vector<std::shared_ptr<uint16_t[]>>& squares, size_t most_bytes) const;

  size_t bytes() const;      ///< On the host; the device holds the same number.
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

  mutable std::mutex mutex_;  ///< Squares may be freed on any thread.
  std::vector<std::pair<PinnedBuffer<uint16_t>, DeviceBuffer<uint16_t>>> chunks_;
  std::vector<SquaresPlace> free_;  ///< Has capacity for all places, so freeing does not allocate.
};

class DistanceComputer {
 public:
  /// @param most_bytes Limit on the memory for squares on the device; the host uses the same
  ///   amount.
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
