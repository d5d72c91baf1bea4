/// The stages "copy" and "upload": a frame's raw image to the device.
#pragma once

#include <cstring>
#include <vector>

#include "backend/frame_check.h"
#include "backend/profile.h"
#include "runtime/buffer.h"
#include "runtime/stage_clock.h"

namespace dtsdf {

namespace gpu {

/// The image with its rows packed; the buffers are kept from frame to frame.
class RawImage {
 public:
  /// Enqueues the upload of an image, which is not needed any more on return. The last upload must
  /// be done.
  /// In bands, so that each is on its way while the host copies the next. A profile tells the two
  /// apart: with it, the image is one band.
  template <class Frame>
  void upload(const Frame& frame, const Stream& stream) {
    constexpr int kBandEnds[] = {3, 5, 6};  // in sixths: the device waits for the last, small one
    const size_t row = packedRowBytes(frame);
    bytes_ = row * frame.height;
    pinned_raw_.reserve(bytes_);
    raw_.reserveExactly(bytes_, stream);
    const bool in_bands = profileOf(stream) == nullptr;
    int begin = 0;
    for (const int sixths : kBandEnds) {
      if (!in_bands && sixths < 6) continue;
      const int end = frame.height * sixths / 6;
      {
        const StageTimer timer(profileOf(stream), Stage::kCopy);
        copyRows(static_cast<const char*>(frame.data), frame.row_bytes, row, begin, end);
      }
      holdForProfile(stream);
      const StageSpan span(stream, Stage::kUpload);
      raw_.uploadPart(pinned_raw_.data(), begin * row, end * row, stream);
      begin = end;
    }
  }

  const unsigned char* data() const { return raw_.data(); }  ///< On the device.
  size_t bytes() const { return bytes_; }
  /// `name` tells what image it is.
  void addMemory(const char* name, std::vector<MemoryPart>& parts) const {
    addScratch(name, parts, raw_, pinned_raw_);
  }

 private:
  /// Copies rows of the image to pinned memory, packed.
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
