/// Typed RAII buffers in device memory and in page-locked (pinned) host memory.
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

/// Page-locked host memory. Copies to and from the device run asynchronously, and kernels can read
/// and write it in place, which is faster than copying a small buffer.
template <class T>
class PinnedBuffer {
  static_assert(std::is_trivially_copyable<T>::value, "copied as bytes");

 public:
  static constexpr auto kSum = &MapperMemory::staging;

  PinnedBuffer() = default;
  explicit PinnedBuffer(size_t count) { reserve(count); }
  ~PinnedBuffer() {
    if (data_ != nullptr) cudaFreeHost(data_);
  }
  PinnedBuffer(PinnedBuffer&& other) noexcept { swap(other); }
  PinnedBuffer& operator=(PinnedBuffer&& other) noexcept {
    swap(other);
    return *this;
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  size_t capacity() const { return capacity_; }
  size_t bytes() const { return capacity_ * sizeof(T); }
  T& operator[](size_t i) { return data_[i]; }
  const T& operator[](size_t i) const { return data_[i]; }

  /// Makes room for `count` elements, with some to spare. If the buffer has to grow, its contents
  /// are lost. No copy or kernel may be using it.
  void reserve(size_t count) {
    if (count > capacity_) reserveExactly(count + count / 2);
  }

  /// Like reserve(), but without spare capacity.
  void reserveExactly(size_t capacity) {
    if (capacity <= capacity_) return;
    PinnedBuffer larger;
    void* memory = nullptr;
    DTSDF_CHECK_CUDA(cudaHostAlloc(&memory, capacity * sizeof(T), cudaHostAllocDefault));
    larger.data_ = static_cast<T*>(memory);
    larger.capacity_ = capacity;
    swap(larger);
  }

 private:
  void swap(PinnedBuffer& other) {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
  }

  T* data_ = nullptr;
  size_t capacity_ = 0;
};

/// Device memory. data() changes when the buffer grows, so call it again for every launch.
template <class T>
class DeviceBuffer {
  static_assert(std::is_trivially_copyable<T>::value, "copied as bytes");

 public:
  static constexpr auto kSum = &MapperMemory::scratch;

  DeviceBuffer() = default;
  explicit DeviceBuffer(size_t count) { allocate(count); }
  ~DeviceBuffer() {
    if (data_ != nullptr) cudaFree(data_);
  }
  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    swap(other);
    return *this;
  }

  T* data() const { return data_; }
  size_t capacity() const { return capacity_; }
  size_t bytes() const { return capacity_ * sizeof(T); }

  /// Makes room for `count` elements, with some to spare. If the buffer has to grow, its contents
  /// are lost, and the call waits for the stream, whose work may use the old memory. @throws
  /// BackendError if memory runs out; the buffer is then unchanged.
  void reserve(size_t count, const Stream& stream) {
    if (count <= capacity_) return;
    DeviceBuffer larger(count + count / 2);
    stream.synchronize();
    swap(larger);
  }

  /// Like reserve(), but without spare capacity, for sizes that do not grow gradually, such as
  /// those of images.
  void reserveExactly(size_t count, const Stream& stream) {
    if (count <= capacity_) return;
    DeviceBuffer larger(count);
    stream.synchronize();
    swap(larger);
  }

  /// Makes room for `count` elements, with some to spare. Keeps the contents, zeroes new memory,
  /// and waits for the stream if the buffer has to grow.
  void growZeroed(size_t count, const Stream& stream) {
    if (count <= capacity_) return;
    DeviceBuffer larger(count + count / 2);
    larger.zero(stream);
    if (data_ != nullptr) {
      DTSDF_CHECK_CUDA(
          cudaMemcpyAsync(larger.data_, data_, bytes(), cudaMemcpyDeviceToDevice, stream.get()));
    }
    stream.synchronize();
    swap(larger);
  }

  void zero(const Stream& stream) { fill(0, stream); }
  void fill(int byte, const Stream& stream) {
    if (data_ != nullptr) {
      DTSDF_CHECK_CUDA(cudaMemsetAsync(data_, byte, bytes(), stream.get()));
    }
  }

  void upload(const T* pinned, size_t count, const Stream& stream) {
    uploadPart(pinned, 0, count, stream);
  }
  /// Uploads elements [begin, end) from the same indices in pinned memory.
  void uploadPart(const T* pinned, size_t begin, size_t end, const Stream& stream) {
    if (begin == end) return;
    DTSDF_CHECK_CUDA(cudaMemcpyAsync(data_ + begin, pinned + begin, (end - begin) * sizeof(T),
                                     cudaMemcpyHostToDevice, stream.get()));
  }
  void download(T* pinned, size_t count, const Stream& stream) const {
    downloadPart(pinned, 0, count, stream);
  }
  /// Downloads elements [begin, end) to the same indices in pinned memory.
  void downloadPart(T* pinned, size_t begin, size_t end, const Stream& stream) const {
    if (begin == end) return;
    DTSDF_CHECK_CUDA(cudaMemcpyAsync(pinned + begin, data_ + begin, (end - begin) * sizeof(T),
                                     cudaMemcpyDeviceToHost, stream.get()));
  }

 private:
  void allocate(size_t count) {
    void* memory = nullptr;
    DTSDF_CHECK_CUDA(cudaMalloc(&memory, count * sizeof(T)));
    data_ = static_cast<T*>(memory);
    capacity_ = count;
  }
  void swap(DeviceBuffer& other) {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
  }

  T* data_ = nullptr;
  size_t capacity_ = 0;
};

/// Adds the sizes of buffers: device memory to `scratch`, host memory to `staging`.
template <class... Buffers>
void addScratch(MapperMemory& memory, const Buffers&... buffers) {
  ((memory.*Buffers::kSum += buffers.bytes()), ...);
}

}  // namespace gpu
}  // namespace dtsdf
