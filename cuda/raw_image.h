/// The stages "copy" and "upload": a frame's raw image to the device.
#pragma once

#include <vector>

#include "backend/profile.h"
#include "runtime/buffer.h"

namespace dtsdf {

struct ImageRows;

namespace gpu {

/// The image with its rows packed; the buffers are kept from frame to frame.
class RawImage {
 public:
  /// Enqueues the upload of an image, which is not needed any more on return. The last upload must
  /// be done.
  void upload(const ImageRows& rows, const Stream& stream);

  const unsigned char* data() const { return raw_.data(); }  ///< On the device.
  size_t bytes() const { return bytes_; }
  /// `name` tells what image it is.
  void addMemory(const char* name, std::vector<MemoryPart>& parts) const;

 private:
  void copyRows(const ImageRows& rows, int begin, int end);

  PinnedBuffer<unsigned char> pinned_raw_;
  DeviceBuffer<unsigned char> raw_;
  size_t bytes_ = 0;
};

}  // namespace gpu
}  // namespace dtsdf
