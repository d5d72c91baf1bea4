/// Distances between cells of space, worked out on the device.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "backend/profile.h"
#include "kernels/space/squared_distances.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// Page-locked memory for the squares of sectors, which kernels write in place. What is given back
/// is used again.
class SquaresPool : public std::enable_shared_from_this<SquaresPool> {
 public:
  /// Of one sector; the pool lives as long as the last of them.
  std::shared_ptr<uint16_t[]> take();

  size_t bytes() const;

 private:
  static constexpr size_t kChunkSectors = 64;
  static constexpr size_t kChunkSquares = kChunkSectors * kCellsPerSector;

  void grow();
  void giveBack(uint16_t* squares) noexcept;

  mutable std::mutex mutex_;  ///< Sectors go wherever pages of them are written.
  std::vector<PinnedBuffer<uint16_t>> chunks_;
  std::vector<uint16_t*> free_;  ///< With room for all that there are.
};

class DistanceMaker {
 public:
  DistanceMaker() = default;
  ~DistanceMaker() { stream_.drain(); }
  DistanceMaker(const DistanceMaker&) = delete;
  DistanceMaker& operator=(const DistanceMaker&) = delete;

  /// What space has of it, on a stream of its own. @throws CudaError
  std::vector<std::shared_ptr<uint16_t[]>> make(const DistanceTask& task);

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  DistanceTask upload(const DistanceTask& task);

  Stream stream_;
  std::shared_ptr<SquaresPool> pool_ = std::make_shared<SquaresPool>();
  PinnedBuffer<char> staged_;
  DeviceBuffer<char> task_;
  DeviceBuffer<uint16_t> planes_;
  DeviceBuffer<uint8_t> plane_has_any_;
  PinnedBuffer<uint16_t*> results_;
  PinnedBuffer<uint32_t> is_near_;
};

}  // namespace gpu
}  // namespace dtsdf
