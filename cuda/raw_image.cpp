#include "raw_image.h"

#include <cstring>

#include "dtsdf_mapping/depth_frame.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kUploadBands = 4;

size_t rowBytes(const DepthFrame& frame) {
  return static_cast<size_t>(frame.width) *
         (frame.encoding == DepthEncoding::kUint16 ? sizeof(uint16_t) : sizeof(float));
}

}  // namespace

/// Copies rows of the image to pinned memory, packed.
void RawImage::copyRows(const DepthFrame& frame, int begin, int end) {
  const size_t row = rowBytes(frame);
  const char* from = static_cast<const char*>(frame.data);
  if (frame.row_bytes == row) {
    std::memcpy(pinned_raw_.data() + begin * row, from + begin * row, (end - begin) * row);
    return;
  }
  for (int v = begin; v < end; ++v) {
    std::memcpy(pinned_raw_.data() + v * row, from + v * frame.row_bytes, row);
  }
}

/// In bands, so that each is on its way while the host copies the next. A profile tells the two
/// apart: with it, the image is one band.
void RawImage::upload(const DepthFrame& frame, const Stream& stream) {
  const size_t row = rowBytes(frame);
  bytes_ = row * frame.height;
  pinned_raw_.reserve(bytes_);
  raw_.reserveExactly(bytes_, stream);
  const int bands = profileOf(stream) == nullptr ? kUploadBands : 1;
  for (int i = 0; i < bands; ++i) {
    const int begin = frame.height * i / bands, end = frame.height * (i + 1) / bands;
    {
      const StageTimer timer(profileOf(stream), Stage::kCopy);
      copyRows(frame, begin, end);
    }
    holdForProfile(stream);
    const StageSpan span(stream, Stage::kUpload);
    raw_.uploadPart(pinned_raw_.data(), begin * row, end * row, stream);
  }
}

void RawImage::addMemory(std::vector<MemoryPart>& parts) const {
  parts.push_back({"raw image", MemoryKind::kScratch, raw_.bytes(), raw_.bytes()});
  parts.push_back({"raw image", MemoryKind::kStaging, pinned_raw_.bytes(), pinned_raw_.bytes()});
}

}  // namespace gpu
}  // namespace dtsdf
