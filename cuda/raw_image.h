/// The stages "copy" and "upload": a frame's raw image to the device.
#pragma once

#include <vector>

#include "backend/profile.h"
#include "runtime/buffer.h"

namespace dtsdf {

struct DepthFrame;

namespace gpu {

/// The image with its rows packed; the buffers are kept from frame to frame.
class RawImage {
 public:
  /// Enqueues the upload of a frame's image, whose data is not needed any more on return. The last
  /// upload must be done.
  void upload(const DepthFrame& frame, const Stream& stream);

  const void* data() const { return raw_.data(); }  ///< On the device.
  size_t bytes() const { return bytes_; }
  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  void copyRows(const DepthFrame& frame, int begin, int end);

  PinnedBuffer<unsigned char> pinned_raw_;
  DeviceBuffer<unsigned char> raw_;
  size_t bytes_ = 0;
};

}  // namespace gpu
}  // namespace dtsdf
