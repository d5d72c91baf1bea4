#include "io/inspection.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <utility>

#include "io/wrapped_images.h"
#include "params/intrinsics_check.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// Below this share of measured pixels, an image shows almost nothing.
constexpr double kFewPixels = 0.05;
/// Below this share of images with a pose, images and poses probably do not match.
constexpr double kFewPoses = 0.5;

template <class Pixel>
void appendMeasured(const DepthFrame& frame, std::vector<float>& depths_m) {
  std::vector<Pixel> row(static_cast<size_t>(frame.width));
  for (int v = 0; v < frame.height; ++v) {
    const auto* bytes =
        static_cast<const char*>(frame.data) + static_cast<size_t>(v) * frame.row_bytes;
    std::memcpy(row.data(), bytes, row.size() * sizeof(Pixel));
    for (const Pixel raw : row) {
      const auto value = static_cast<float>(raw);
      const bool overflow = sizeof(Pixel) == sizeof(kNoDepth16) && value >= kNoDepth16;
      if (value > 0.0f && std::isfinite(value) && !overflow) {
        depths_m.push_back(value * frame.unit_m);
      }
    }
  }
}

std::vector<float> measuredDepths(const std::deque<SourceFrame>& frames) {
  std::vector<float> depths_m;
  for (const SourceFrame& frame : frames) {
    if (frame.depth.encoding == DepthEncoding::kUint16) {
      appendMeasured<uint16_t>(frame.depth, depths_m);
    } else {
      appendMeasured<float>(frame.depth, depths_m);
    }
  }
  return depths_m;
}

Inspection summarise(const std::deque<SourceFrame>& frames, const FrameSource& source) {
  Inspection found;
  found.frames = frames.size();
  found.images = source.size();
  found.posed = source.posed();
  for (const auto& [reason, count] : source.skipped()) found.images_passed_over += count;
  if (frames.empty()) return found;
  const DepthFrame& first = frames.front().depth;
  found.width = first.width;
  found.height = first.height;
  found.intrinsics = first.intrinsics;
  found.units_per_metre = 1.0 / static_cast<double>(first.unit_m);
  size_t pixels = 0;
  for (const SourceFrame& frame : frames) {
    pixels += static_cast<size_t>(frame.depth.width) * static_cast<size_t>(frame.depth.height);
  }
  std::vector<float> depths_m = measuredDepths(frames);
  if (depths_m.empty()) return found;
  found.measured_share = static_cast<double>(depths_m.size()) / static_cast<double>(pixels);
  const auto middle = depths_m.begin() + static_cast<std::ptrdiff_t>(depths_m.size() / 2);
  std::nth_element(depths_m.begin(), middle, depths_m.end());
  found.median_depth_m = *middle;
  return found;
}

/// Three digits with a suitable unit.
std::string inWords(double length_m) {
  if (length_m >= 1000.0) return formatted("%.3g km", length_m / 1000.0);
  if (length_m >= 0.01) return formatted("%.3g m", length_m);
  return formatted("%.3g mm", 1000.0 * length_m);
}

std::string inWords(const Intrinsics& K) {
  return formatted("fx %g, fy %g, cx %g, cy %g", static_cast<double>(K.fx),
                   static_cast<double>(K.fy), static_cast<double>(K.cx), static_cast<double>(K.cy));
}

/// Rounded, since it comes from a float.
std::string unitsInWords(double units_per_metre) { return formatted("%.6g", units_per_metre); }

std::string imagesInWords(const Inspection& found) {
  if (!found.images) return "images";
  return std::to_string(*found.images) + (*found.images == 1 ? " image" : " images");
}

/// ", 298 with a pose", or how many were skipped; empty if none was.
std::string describePoses(const Inspection& found) {
  if (found.posed) return ", " + std::to_string(*found.posed) + " with a pose";
  if (found.images_passed_over == 0) return "";
  return ", " + std::to_string(found.images_passed_over) + " of the first " +
         std::to_string(found.frames + found.images_passed_over) + " skipped";
}

}  // namespace

std::unique_ptr<FrameSource> inspect(std::unique_ptr<FrameSource> source, size_t frames,
                                     Inspection& found) {
  std::deque<SourceFrame> ahead;
  while (ahead.size() < frames) {
    std::optional<SourceFrame> frame = source->next();
    if (!frame) break;
    ahead.push_back(std::move(*frame));
  }
  found = summarise(ahead, *source);
  return std::make_unique<WrappedImages<SourceFrame>>(
      std::move(source), [ahead = std::move(ahead)](FrameSource& images) mutable {
        if (ahead.empty()) return images.next();
        std::optional<SourceFrame> frame = std::move(ahead.front());
        ahead.pop_front();
        return frame;
      });
}

std::string describe(const Inspection& found) {
  if (found.frames == 0) return "no usable image";
  return imagesInWords(found) + " of " + std::to_string(found.width) + " x " +
         std::to_string(found.height) + " (" + inWords(found.intrinsics) + ")" +
         describePoses(found) + "; median depth " +
         (found.median_depth_m ? inWords(*found.median_depth_m) : "unknown") + ", " +
         std::to_string(std::lround(100.0 * found.measured_share)) + " % of the pixels measured";
}

std::vector<std::string> warningsAbout(const Inspection& found, double min_depth_m,
                                       double max_depth_m) {
  std::vector<std::string> warnings;
  if (found.frames == 0) return warnings;  // the run itself reports this
  const std::string which = "the first " + std::to_string(found.frames) + " images";
  const std::string camera = doubtAbout(found.intrinsics, found.width, found.height);
  if (!camera.empty()) warnings.push_back(camera);
  if (!found.median_depth_m) {
    warnings.push_back(which + " have no measured pixel: are these depth images?");
  } else if (found.measured_share < kFewPixels) {
    warnings.push_back("hardly any pixel of " + which + " is measured: are these depth images?");
  }
  if (found.median_depth_m &&
      (*found.median_depth_m < min_depth_m || *found.median_depth_m > max_depth_m)) {
    warnings.push_back("median depth " + inWords(*found.median_depth_m) + ": is the scale " +
                       unitsInWords(found.units_per_metre) + "? The mapped range is " +
                       inWords(min_depth_m) + " to " + inWords(max_depth_m) +
                       " (fusion/min_depth_m, fusion/max_depth_m)");
  }
  if (found.images && found.posed &&
      static_cast<double>(*found.posed) < kFewPoses * static_cast<double>(*found.images)) {
    warnings.push_back("only " + std::to_string(*found.posed) + " of " +
                       std::to_string(*found.images) + " images have a pose: do the stamps match?");
  }
  if (!found.posed && found.images_passed_over > found.frames) {
    warnings.push_back(std::to_string(found.images_passed_over) + " of the first " +
                       std::to_string(found.frames + found.images_passed_over) +
                       " images cannot be used: do stamps and frames match?");
  }
  return warnings;
}

}  // namespace dtsdf
