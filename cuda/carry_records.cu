#include "carry_records.h"

#include <algorithm>
#include <new>
#include <utility>

#include "launch.h"
#include "runtime/device.h"

namespace dtsdf {
namespace gpu {
namespace {

/// One thread per 16 bytes.
template <class Pool>
__global__ void gatherPiecesKernel(typename Pool::View pool, const RecordPiece* pieces,
                                   size_t count) {
  constexpr size_t kWords = Pool::kRecordBytes / sizeof(uint4);
  const size_t i = globalThread();
  if (i >= count * kWords) return;
  const RecordPiece piece = pieces[i / kWords];
  piece.bytes[i % kWords] = reinterpret_cast<const uint4*>(pool.record(piece.record))[i % kWords];
}

/// The same.
template <class Pool>
__global__ void scatterPiecesKernel(typename Pool::View pool, const RecordPiece* pieces,
                                    size_t count) {
  constexpr size_t kWords = Pool::kRecordBytes / sizeof(uint4);
  const size_t i = globalThread();
  if (i >= count * kWords) return;
  const RecordPiece piece = pieces[i / kWords];
  const uint4 word = piece.bytes == nullptr ? uint4{} : piece.bytes[i % kWords];
  reinterpret_cast<uint4*>(pool.record(piece.record))[i % kWords] = word;
}

/// Copies a list to pinned memory, moves on there, and starts the kernel for it.
template <class Pool, class Kernel>
void launchPieces(Kernel kernel, const Pool& pool, const std::vector<RecordPiece>& pieces,
                  RecordPiece*& pinned, const Stream& stream) {
  if (pieces.empty()) return;
  std::copy(pieces.begin(), pieces.end(), pinned);
  kernel<<<blocksFor(pieces.size() * Pool::kRecordBytes / sizeof(uint4)), kThreads, 0,
           stream.get()>>>(pool.view(), pinned, pieces.size());
  DTSDF_CHECK_LAUNCH("a kernel that moves blocks");
  pinned += pieces.size();
}

}  // namespace

/// Of few sizes, so that it can be used again.
SharedRecords PinnedPool::make(size_t bytes) {
  constexpr size_t kStep = size_t{1} << 20;
  useDevice(device_);
  Memory memory;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = std::find_if(idle_.begin(), idle_.end(), [&](const Memory& one) {
      return bytes <= one.bytes.capacity() && one.bytes.capacity() <= bytes + 2 * kStep;
    });
    if (found != idle_.end()) {
      memory = std::move(*found);
      idle_.erase(found);
      idle_bytes_ -= memory.bytes.bytes();
    }
  }
  memory.bytes.reserveExactly((bytes / kStep + 1) * kStep);
  memory.used.wait();
  return std::make_shared<PinnedRecords>(bytes, shared_from_this(), std::move(memory));
}

/// What was used longest ago goes where much is idle, and all where memory lacks for the list.
void PinnedPool::giveBack(Memory memory) {
  constexpr size_t kMostIdleBytes = size_t{48} << 20;
  std::vector<Memory> too_many;
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    const size_t bytes = memory.bytes.bytes();
    idle_.push_back(std::move(memory));
    idle_bytes_ += bytes;
    while (idle_bytes_ > kMostIdleBytes) {
      const size_t oldest_bytes = idle_.front().bytes.bytes();
      too_many.push_back(std::move(idle_.front()));
      idle_.pop_front();
      idle_bytes_ -= oldest_bytes;
    }
  } catch (const std::bad_alloc&) {
  }
}

size_t PinnedPool::idleBytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return idle_bytes_;
}

RecordsMaker RecordCarrier::maker() const {
  return [pool = pool_](size_t bytes) { return pool->make(bytes); };
}

/// Waits until the turn's list is free.
RecordCarrier::Turn& RecordCarrier::nextTurn(size_t pieces) {
  Turn& turn = turns_[++turn_ % 2];
  turn.read.wait();
  turn.pieces.reserve(pieces);
  return turn;
}

void RecordCarrier::reserve(size_t pieces) {
  for (Turn& turn : turns_) {
    if (pieces <= turn.pieces.capacity()) continue;
    turn.read.wait();
    turn.pieces.reserve(pieces);
  }
}

SharedRecords RecordCarrier::takeOut(RecordPieces pieces, size_t bytes, DeviceMap& map) {
  Turn& turn = nextTurn(pieces.count());
  if (bytes > turn.staging.capacity()) turn.copied.wait();
  turn.staging.reserve(bytes, stream_);
  const SharedRecords shared = pool_->make(bytes);
  auto& records = static_cast<PinnedRecords&>(*shared);
  for (std::vector<RecordPiece>* list : {&pieces.arrays, &pieces.bricks, &pieces.labels}) {
    for (RecordPiece& piece : *list) {
      const auto begin = reinterpret_cast<uintptr_t>(piece.bytes);
      piece.bytes = reinterpret_cast<uint4*>(turn.staging.data() + begin);
    }
  }
  stream_.waitFor(turn.copied);
  RecordPiece* pinned = turn.pieces.data();
  launchPieces(gatherPiecesKernel<VoxelPool>, map.voxels(), pieces.arrays, pinned, stream_);
  launchPieces(gatherPiecesKernel<ColourPool>, map.colours(), pieces.bricks, pinned, stream_);
  launchPieces(gatherPiecesKernel<LabelPool>, map.labels(), pieces.labels, pinned, stream_);
  stream_.record(turn.read);
  copies_.waitFor(turn.read);
  turn.staging.download(records.data(), bytes, copies_);
  copies_.record(turn.copied);
  copies_.record(records.used());
  return shared;
}

void RecordCarrier::putIn(const RecordPieces& pieces, const std::vector<PinnedRecords*>& records,
                          DeviceMap& map) {
  for (PinnedRecords* const one : records) stream_.waitFor(one->used());
  Turn& turn = nextTurn(pieces.count());
  RecordPiece* pinned = turn.pieces.data();
  launchPieces(scatterPiecesKernel<VoxelPool>, map.voxels(), pieces.arrays, pinned, stream_);
  launchPieces(scatterPiecesKernel<ColourPool>, map.colours(), pieces.bricks, pinned, stream_);
  launchPieces(scatterPiecesKernel<LabelPool>, map.labels(), pieces.labels, pinned, stream_);
  stream_.record(turn.read);
  for (PinnedRecords* const one : records) stream_.record(one->used());
}

void RecordCarrier::addMemory(std::vector<MemoryPart>& parts) const {
  size_t staging = 0, pinned = pool_->idleBytes();
  for (const Turn& turn : turns_) {
    staging += turn.staging.bytes();
    pinned += turn.pieces.bytes();
  }
  parts.push_back({"blocks that leave", MemoryKind::kScratch, staging, staging});
  parts.push_back({"blocks that leave", MemoryKind::kStaging, pinned, pinned});
}

}  // namespace gpu
}  // namespace dtsdf
