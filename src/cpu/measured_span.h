/// The part of a row of an image that holds measurements: the rest of an image of a single thing is
/// passed over.
#pragma once

#include <algorithm>
#include <cstring>

namespace dtsdf {

struct PixelSpan {
  int begin, end;  ///< None: both the same.
};

/// From the first value that is not 0 to the last, and some beside them: from one multiple of 16
/// pixels, and so of squares of pixels, to the next.
inline PixelSpan measuredSpan(const float* row, int width) {
  constexpr int kStep = 16;  // asked at once
  constexpr float kBlank[kStep] = {};
  const auto isBlank = [&](int first) {
    return std::memcmp(row + first, kBlank, std::min(kStep, width - first) * sizeof(float)) == 0;
  };
  PixelSpan span{0, (width + kStep - 1) / kStep * kStep};
  while (span.begin < span.end && isBlank(span.begin)) span.begin += kStep;
  while (span.begin < span.end && isBlank(span.end - kStep)) span.end -= kStep;
  return {std::min(span.begin, width), std::min(span.end, width)};
}

/// The least that holds both.
inline PixelSpan unite(const PixelSpan& a, const PixelSpan& b) {
  if (a.begin == a.end) return b;
  if (b.begin == b.end) return a;
  return {std::min(a.begin, b.begin), std::max(a.end, b.end)};
}

}  // namespace dtsdf
