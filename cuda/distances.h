/// Distances between cells of space, worked out on the device.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "kernels/space/squared_distances.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// The squares of a sector where kernels write them in place: page-locked, with a copy on the
/// device to compare with.
struct SquaresPlace {
  uint16_t *host, *device;
  bool is_new;  ///< Nothing is there yet.
};

/// Such memory. What is given back is used again.
class SquaresPool : public std::enable_shared_from_this<SquaresPool> {
 public:
  /// Where these squares are, or other ones that replace them: if they are not of a pool. The pool
  /// lives as long as the last of them.
  SquaresPlace placeOf(std::shared_ptr<uint16_t[]>& squares);

  /// Whether places of all these keep within a limit of memory.
  bool hasRoomFor(const std::vector<std::shared_ptr<uint16_t[]>>& squares, size_t most_bytes) const;

  size_t bytes() const;      ///< On the host, and as many on the device.
  size_t freeBytes() const;  ///< The part of these that nobody has.

 private:
  static constexpr size_t kChunkSectors = 16;
  static constexpr size_t kChunkSquares = kChunkSectors * kCellsPerSector;

  struct GiveBack {
    std::shared_ptr<SquaresPool> pool;
    uint16_t* device;
    void operator()(uint16_t* host) const noexcept;
  };
  struct Chunk {
    PinnedBuffer<uint16_t> host;
    DeviceBuffer<uint16_t> device;
  };

  SquaresPlace take();
  void grow();

  mutable std::mutex mutex_;  ///< Sectors go wherever pages of them are written.
  std::vector<Chunk> chunks_;
  std::vector<SquaresPlace> free_;  ///< With room for all that there are.
};

class DistanceMaker {
 public:
  /// @param most_bytes Limit of squares on the device, and as many on the host.
  explicit DistanceMaker(size_t most_bytes) : most_bytes_(most_bytes) {}
  ~DistanceMaker() { stream_.drain(); }

  /// As a DistanceWork, on a stream of its own. @return false beyond the limit.
  /// @throws BackendError
  bool make(const DistanceTask& task, std::vector<std::shared_ptr<uint16_t[]>>& squares);

  void addMemory(MapperMemory& memory) const;

 private:
  DistanceTask upload(const DistanceTask& task, const SquaresPlace*& results);

  const size_t most_bytes_;
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
