/// The stages "copy" and "upload": copy a frame's raw image to pinned memory and upload it.
#pragma once

#include <cstring>
#include <vector>

#include "backend/frame_check.h"
#include "dtsdf_mapping/mapper.h"
#include "runtime/buffer.h"

namespace dtsdf {

namespace gpu {

/// A raw image on the device, with packed rows.
class RawImage {
 public:
  /// Copies an image to pinned memory and enqueues its upload, band by band: each band is uploaded
  /// while the host copies the next one. The image may be freed on return. @pre The previous upload
  /// has finished.
  template <class Frame>
  void upload(const Frame& frame, const Stream& stream) {
    constexpr int kBandEnds[] = {3, 5, 6};  // in sixths of the image's height
    const size_t row = packedRowBytes(frame);
    bytes_ = row * frame.height;
    pinned_raw_.reserve(bytes_);
    raw_.reserveExactly(bytes_, stream);
    int begin = 0;
    for (const int sixths : kBandEnds) {
      const int end = frame.height * sixths / 6;
      copyRows(static_cast<const char*>(frame.data), frame.row_bytes, row, begin, end);
      raw_.uploadPart(pinned_raw_.data(), begin * row, end * row, stream);
      begin = end;
    }
  }

  const unsigned char* data() const { return raw_.data(); }  ///< On the device.
  size_t bytes() const { return bytes_; }
  void addMemory(MapperMemory& memory) const { addScratch(memory, raw_, pinned_raw_); }

 private:
  /// Copies rows of the image to pinned memory, without padding.
  void copyRows(const char* rows, size_t row_bytes, size_t packed, int begin, int end) {
    if (row_bytes == packed) {
      std::memcpy(pinned_raw_.data() + begin * packed, rows + begin * packed,
                  (end - begin) * packed);
      return;
    }
    for (int v = begin; v < end; ++v) {
      std::memcpy(pinned_raw_.data() + v * packed, rows + v * row_bytes, packed);
    }
  }

  PinnedBuffer<unsigned char> pinned_raw_;
  DeviceBuffer<unsigned char> raw_;
  size_t bytes_ = 0;
};

}  // namespace gpu
}  // namespace dtsdf
