#include "raw_image.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "backend/frame_check.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kUploadBands = 2;

/// Copies past the caches, where the processor can: the bus reads twice as fast what is in memory.
void copyPastCaches(unsigned char* to, const char* from, size_t bytes) {
#ifdef __SSE2__
  constexpr size_t kLine = 64, kPart = sizeof(__m128i);
  const size_t head = std::min(bytes, -reinterpret_cast<uintptr_t>(to) % kLine);
  std::memcpy(to, from, head);
  size_t at = head;
  for (; at + kLine <= bytes; at += kLine) {
    for (size_t part = at; part < at + kLine; part += kPart) {
      const __m128i value = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + part));
      _mm_stream_si128(reinterpret_cast<__m128i*>(to + part), value);
    }
  }
  _mm_sfence();
  std::memcpy(to + at, from + at, bytes - at);
#else
  std::memcpy(to, from, bytes);
#endif
}

}  // namespace

/// Copies rows of the image to pinned memory, packed.
void RawImage::copyRows(const ImageRows& rows, int begin, int end) {
  const size_t packed = rows.packed_bytes;
  if (rows.row_bytes == packed) {
    copyPastCaches(pinned_raw_.data() + begin * packed, rows.data + begin * packed,
                   (end - begin) * packed);
    return;
  }
  for (int v = begin; v < end; ++v) {
    copyPastCaches(pinned_raw_.data() + v * packed, rows.data + v * rows.row_bytes, packed);
  }
}

/// In bands, so that each is on its way while the host copies the next. A profile tells the two
/// apart: with it, the image is one band.
void RawImage::upload(const ImageRows& rows, const Stream& stream) {
  const size_t row = rows.packed_bytes;
  bytes_ = row * rows.height;
  pinned_raw_.reserve(bytes_);
  raw_.reserveExactly(bytes_, stream);
  const int bands = profileOf(stream) == nullptr ? kUploadBands : 1;
  for (int i = 0; i < bands; ++i) {
    const int begin = rows.height * i / bands, end = rows.height * (i + 1) / bands;
    {
      const StageTimer timer(profileOf(stream), Stage::kCopy);
      copyRows(rows, begin, end);
    }
    holdForProfile(stream);
    const StageSpan span(stream, Stage::kUpload);
    raw_.uploadPart(pinned_raw_.data(), begin * row, end * row, stream);
  }
}

void RawImage::addMemory(const char* name, std::vector<MemoryPart>& parts) const {
  parts.push_back({name, MemoryKind::kScratch, raw_.bytes(), raw_.bytes()});
  parts.push_back({name, MemoryKind::kStaging, pinned_raw_.bytes(), pinned_raw_.bytes()});
}

}  // namespace gpu
}  // namespace dtsdf
