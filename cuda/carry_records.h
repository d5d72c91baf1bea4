/// Records of blocks that leave the device, or are back on it: all that is kept of a block, back to
/// back, in pinned memory. Frames wait for neither.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "backend/profile.h"
#include "device_map.h"
#include "map/record_bytes.h"

namespace dtsdf {
namespace gpu {

/// Pinned memory that is used again and again. Any thread may use it.
class PinnedPool : public std::enable_shared_from_this<PinnedPool> {
 public:
  struct Memory {
    PinnedBuffer<char> bytes;
    Event used;  ///< By the device, which reads it or writes to it until then.
  };

  explicit PinnedPool(int device) : device_(device) {}

  /// At least so many bytes that the device does not use. @throws CudaError without memory.
  SharedRecords make(size_t bytes);
  void giveBack(Memory memory);
  size_t idleBytes() const;

 private:
  const int device_;
  mutable std::mutex mutex_;
  std::deque<Memory> idle_;  ///< Those that were given back last at the end.
  size_t idle_bytes_ = 0;    ///< Of these.
};

/// Gives its memory back to the pool, which it keeps alive.
class PinnedRecords : public RecordBytes {
 public:
  PinnedRecords(size_t size, std::shared_ptr<PinnedPool> pool, PinnedPool::Memory memory)
      : RecordBytes(size), pool_(std::move(pool)), memory_(std::move(memory)) {}
  ~PinnedRecords() override { pool_->giveBack(std::move(memory_)); }
  char* data() override { return memory_.bytes.data(); }
  void wait() override { memory_.used.wait(); }
  Event& used() { return memory_.used; }

 private:
  const std::shared_ptr<PinnedPool> pool_;
  PinnedPool::Memory memory_;
};

/// A record of a pool of the map, and where it goes or comes from. Null: it becomes 0.
struct RecordPiece {
  uint4* bytes;
  int32_t record;
};

/// Pieces of blocks' records, by the pool that they are of.
struct RecordPieces {
  std::vector<RecordPiece> arrays, bricks, labels;
  size_t count() const { return arrays.size() + bricks.size() + labels.size(); }
};

class RecordCarrier {
 public:
  RecordCarrier(const Stream& stream, int device)
      : stream_(stream), pool_(std::make_shared<PinnedPool>(device)) {}
  ~RecordCarrier() { copies_.drain(); }

  RecordsMaker maker() const;

  /// Takes the memory that lists of so many pieces need.
  void reserve(size_t pieces);

  /// Copies so many bytes out of the map, where pieces have places in the records for addresses.
  /// The map may change when this returns. @throws CudaError without memory.
  SharedRecords takeOut(RecordPieces pieces, size_t bytes, DeviceMap& map);

  /// And back, from these records. @pre They are the maker's, or of takeOut().
  void putIn(const RecordPieces& pieces, const std::vector<PinnedRecords*>& records,
             DeviceMap& map);

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  struct Turn {
    PinnedBuffer<RecordPiece> pieces;  ///< Kernels read them in place,
    Event read;                        ///< and have by then.
    DeviceBuffer<char> staging;
    Event copied;  ///< From there.
  };

  Turn& nextTurn(size_t pieces);

  const Stream& stream_;
  const std::shared_ptr<PinnedPool> pool_;
  Stream copies_;
  Turn turns_[2];
  size_t turn_ = 0;
};

}  // namespace gpu
}  // namespace dtsdf
