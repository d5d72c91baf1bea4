/// Finds the part of an image row that contains all its measurements, so that the rest can be
/// skipped.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace dtsdf {

struct PixelSpan {
  int begin, end;  ///< Equal if the span is empty.

  bool isEmpty() const { return begin == end; }
};

/// Spans begin and end at multiples of this number of pixels or at the image border, so that they
/// contain whole patches.
constexpr int kSpanStep = 16;

/// Whether all values from `first` on are 0, up to kSpanStep values or the end of the row.
template <class T>
bool isBlank(const void* row, int first, int width) {
  uint64_t words[kSpanStep * sizeof(T) / sizeof(uint64_t)] = {};
  const char* from = static_cast<const char*>(row) + first * sizeof(T);
  if (width - first >= kSpanStep) {
    std::memcpy(words, from, sizeof(words));
  } else {
    std::memcpy(words, from, (width - first) * sizeof(T));
  }
  uint64_t any = 0;
  for (const uint64_t word : words) any |= word;
  return any == 0;
}

/// The span from the first nonzero value to the last, rounded outwards to kSpanStep.
/// @param row May have any alignment.
/// @param within Span outside which all values must be 0.
template <class T>
PixelSpan measuredSpan(const void* row, int width, const PixelSpan& within) {
  int begin = within.begin, end = (within.end + kSpanStep - 1) / kSpanStep * kSpanStep;
  while (begin < end && isBlank<T>(row, begin, width)) begin += kSpanStep;
  while (begin < end && isBlank<T>(row, end - kSpanStep, width)) end -= kSpanStep;
  if (begin >= end) return {0, 0};
  return {begin, std::min(end, width)};
}

/// The smallest span that contains both.
inline PixelSpan unite(const PixelSpan& a, const PixelSpan& b) {
  if (a.isEmpty()) return b;
  if (b.isEmpty()) return a;
  return {std::min(a.begin, b.begin), std::max(a.end, b.end)};
}

/// An image that is 0 outside one span per row. Its memory is reused for each frame; only the part
/// of the last frame's span that lies outside the new span is zeroed.
template <class T>
class SpanImage {
 public:
  void resize(int width, int height) {
    if (width_ == width && spans_.size() == static_cast<size_t>(height)) return;
    width_ = 0;  // in case an allocation fails
    pixels_.assign(static_cast<size_t>(width) * height, T{});
    spans_.assign(height, {0, 0});
    width_ = width;
  }

  /// Returns a row that is zero outside its new span. The caller must write all pixels of the span.
  /// Thread-safe for different rows.
  T* newRow(size_t v, const PixelSpan& span) {
    T* const row = &pixels_[v * width_];
    const PixelSpan old = spans_[v];
    if (old.begin < span.begin)
      std::fill(row + old.begin, row + std::min(old.end, span.begin), T{});
    if (old.end > span.end) std::fill(row + std::max(old.begin, span.end), row + old.end, T{});
    spans_[v] = span;
    return row;
  }

  const T* data() const { return pixels_.data(); }
  const T* row(size_t v) const { return &pixels_[v * width_]; }
  const PixelSpan& span(size_t v) const { return spans_[v]; }
  size_t bytes() const {
    return pixels_.capacity() * sizeof(T) + spans_.capacity() * sizeof(PixelSpan);
  }

 private:
  int width_ = 0;
  std::vector<T> pixels_;
  std::vector<PixelSpan> spans_;  ///< One per row.
};

}  // namespace dtsdf
