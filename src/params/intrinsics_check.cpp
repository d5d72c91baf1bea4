#include "params/intrinsics_check.h"

#include <cmath>

#include "params/text.h"

namespace dtsdf {
namespace {

/// Minimum focal length, as a fraction of the image's width or height. It corresponds to a field of
/// view of 175 degrees.
constexpr double kShortestFocalLength = 0.02;
/// Smaller images may have the principal point in the first pixel.
constexpr int kSmallImage = 16;
/// Largest plausible offset of the principal point, as a fraction of the image's width or height.
constexpr double kMaxPrincipalOffset = 0.2;

bool isInFirstPixel(float c) { return c > 0.0f && c < 1.0f; }

bool isFarFromCentre(float c, int size) {
  return std::abs(static_cast<double>(c) - 0.5 * size) > kMaxPrincipalOffset * size;
}

}  // namespace

std::string inWords(const Intrinsics& K) {
  return formatted("fx = %g, fy = %g, cx = %g, cy = %g", static_cast<double>(K.fx),
                   static_cast<double>(K.fy), static_cast<double>(K.cx), static_cast<double>(K.cy));
}

std::string findProblem(const Intrinsics& K, int width, int height) {
  const bool is_finite =
      std::isfinite(K.fx) && std::isfinite(K.fy) && std::isfinite(K.cx) && std::isfinite(K.cy);
  if (!is_finite || !(K.fx > 0.0f && K.fy > 0.0f)) {
    return "the intrinsics are " + inWords(K) +
           "; all must be finite, and the focal lengths positive: is the camera calibrated?";
  }
  const bool is_short = K.fx < kShortestFocalLength * width || K.fy < kShortestFocalLength * height;
  const bool is_share =
      width >= kSmallImage && height >= kSmallImage && isInFirstPixel(K.cx) && isInFirstPixel(K.cy);
  if (!is_short && !is_share) return "";
  return "the intrinsics are " + inWords(K) +
         formatted(
             " for images of %d x %d pixels; give them in pixels, not as fractions of the image",
             width, height);
}

std::string doubtAbout(const Intrinsics& K, int width, int height) {
  if (!isFarFromCentre(K.cx, width) && !isFarFromCentre(K.cy, height)) return "";
  return "the intrinsics are " + inWords(K) +
         formatted(", but the image centre is at %g, %g: do they belong to another resolution?",
                   0.5 * width, 0.5 * height);
}

}  // namespace dtsdf
