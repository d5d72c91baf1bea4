#include "move_records.h"

#include <algorithm>
#include <cstring>

#include "launch.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr size_t kBatchBytes = size_t{8} << 20;
constexpr size_t kBytesPerThread = size_t{1} << 20;  ///< Bytes that a host thread copies at a time.

/// One thread per 16 bytes.
template <bool kToHost, class Pool>
__global__ void moveRecordsKernel(typename Pool::View pool, const int32_t* records, size_t count,
                                  uint4* host) {
  constexpr size_t kWords = Pool::kRecordBytes / sizeof(uint4);
  const size_t i = globalThread();
  if (i >= count * kWords) return;
  uint4& word = reinterpret_cast<uint4*>(pool.record(records[i / kWords]))[i % kWords];
  if (kToHost) {
    host[i] = word;
  } else {
    word = host[i];
  }
}

void copyInParallel(char* to, const char* from, size_t bytes) {
  parallelFor((bytes + kBytesPerThread - 1) / kBytesPerThread, 0, [&](size_t i) {
    const size_t first = i * kBytesPerThread;
    std::memcpy(to + first, from + first, std::min(kBytesPerThread, bytes - first));
  });
}

}  // namespace

void RecordMover::reserve() {
  for (StagingBuffer& buffer : staging_) {
    buffer.bytes.reserve(kBatchBytes);
    buffer.records.reserve(kBatchBytes / ColourPool::kRecordBytes);  // for the smallest records
  }
}

/// Waits until the staging buffer is free, then copies the batch's record indices into it.
RecordMover::StagingBuffer& RecordMover::begin(size_t batch, const std::vector<int32_t>& records,
                                               size_t first, size_t end, size_t record_bytes) {
  StagingBuffer& now = staging_[batch % 2];
  now.done.wait();
  now.bytes.reserve((end - first) * record_bytes);
  now.records.reserve(end - first);
  std::copy(records.begin() + static_cast<std::ptrdiff_t>(first),
            records.begin() + static_cast<std::ptrdiff_t>(end), now.records.data());
  return now;
}

template <bool kToHost, class Pool>
void RecordMover::move(const Pool& pool, StagingBuffer& buffer, size_t count) {
  launch("moveRecordsKernel", moveRecordsKernel<kToHost, Pool>,
         blocksFor(count * Pool::kRecordBytes / sizeof(uint4)), kThreads, 0, stream_, pool.view(),
         buffer.records.data(), count, reinterpret_cast<uint4*>(buffer.bytes.data()));
  stream_.record(buffer.done);
}

template <class Pool>
void RecordMover::download(const Pool& pool, const std::vector<int32_t>& records, void* host) {
  constexpr size_t kBytes = Pool::kRecordBytes, kAtOnce = kBatchBytes / kBytes;
  const size_t count = records.size(), batches = (count + kAtOnce - 1) / kAtOnce;
  for (size_t i = 0; i <= batches; ++i) {
    if (i < batches) {
      const size_t first = i * kAtOnce, end = std::min(count, first + kAtOnce);
      move<true>(pool, begin(i, records, first, end, kBytes), end - first);
    }
    if (i == 0) continue;
    const size_t first = (i - 1) * kAtOnce, end = std::min(count, first + kAtOnce);
    const StagingBuffer& before = staging_[(i - 1) % 2];
    before.done.wait();
    copyInParallel(static_cast<char*>(host) + first * kBytes, before.bytes.data(),
                   (end - first) * kBytes);
  }
}

template <class Pool>
void RecordMover::upload(const Pool& pool, const std::vector<int32_t>& records, const void* host) {
  constexpr size_t kBytes = Pool::kRecordBytes, kAtOnce = kBatchBytes / kBytes;
  for (size_t i = 0, first = 0; first < records.size(); ++i, first += kAtOnce) {
    const size_t end = std::min(records.size(), first + kAtOnce);
    StagingBuffer& now = begin(i, records, first, end, kBytes);
    copyInParallel(now.bytes.data(), static_cast<const char*>(host) + first * kBytes,
                   (end - first) * kBytes);
    move<false>(pool, now, end - first);
  }
}

template void RecordMover::download(const VoxelPool&, const std::vector<int32_t>&, void*);
template void RecordMover::download(const ColourPool&, const std::vector<int32_t>&, void*);
template void RecordMover::download(const LabelPool&, const std::vector<int32_t>&, void*);
template void RecordMover::upload(const LabelPool&, const std::vector<int32_t>&, const void*);
template void RecordMover::upload(const VoxelPool&, const std::vector<int32_t>&, const void*);
template void RecordMover::upload(const ColourPool&, const std::vector<int32_t>&, const void*);

void RecordMover::addMemory(MapperMemory& memory) const {
  for (const StagingBuffer& buffer : staging_) addScratch(memory, buffer.bytes, buffer.records);
}

}  // namespace gpu
}  // namespace dtsdf
