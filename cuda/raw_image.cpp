#include "raw_image.h"

#include <cstring>

#include "backend/frame_check.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Where bands of an image end, in sixths of its height: the last is small, since the device waits
/// for it.
constexpr int kBandEnds[] = {3, 5, 6};

}  // namespace

/// Copies rows of the image to pinned memory, packed.
void RawImage::copyRows(const ImageRows& rows, int begin, int end) {
  const size_t packed = rows.packed_bytes;
  if (rows.row_bytes == packed) {
    std::memcpy(pinned_raw_.data() + begin * packed, rows.data + begin * packed,
                (end - begin) * packed);
    return;
  }
  for (int v = begin; v < end; ++v) {
    std::memcpy(pinned_raw_.data() + v * packed, rows.data + v * rows.row_bytes, packed);
  }
}

/// In bands, so that each is on its way while the host copies the next. A profile tells the two
/// apart: with it, the image is one band.
void RawImage::upload(const ImageRows& rows, const Stream& stream) {
  const size_t row = rows.packed_bytes;
  bytes_ = row * rows.height;
  pinned_raw_.reserve(bytes_);
  raw_.reserveExactly(bytes_, stream);
  const bool in_bands = profileOf(stream) == nullptr;
  int begin = 0;
  for (const int sixths : kBandEnds) {
    if (!in_bands && sixths < 6) continue;
    const int end = rows.height * sixths / 6;
    {
      const StageTimer timer(profileOf(stream), Stage::kCopy);
      copyRows(rows, begin, end);
    }
    holdForProfile(stream);
    const StageSpan span(stream, Stage::kUpload);
    raw_.uploadPart(pinned_raw_.data(), begin * row, end * row, stream);
    begin = end;
  }
}

void RawImage::addMemory(const char* name, std::vector<MemoryPart>& parts) const {
  addScratch(name, parts, raw_, pinned_raw_);
}

}  // namespace gpu
}  // namespace dtsdf
