#include "io/first_look.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <utility>

#include "params/intrinsics_check.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// Below this share of measured pixels an image shows next to nothing.
constexpr double kFewPixels = 0.05;
/// Below this share of posed images, they and poses hardly belong together.
constexpr double kFewPoses = 0.5;

/// Hands out frames that were read before, then those of the source.
class FramesReadAhead : public FrameSource {
 public:
  FramesReadAhead(std::deque<SourceFrame> ahead, std::unique_ptr<FrameSource> source)
      : ahead_(std::move(ahead)), source_(std::move(source)) {}

  std::optional<size_t> size() const override { return source_->size(); }
  std::optional<size_t> posed() const override { return source_->posed(); }
  const std::map<std::string, size_t>& skipped() const override { return source_->skipped(); }

  std::optional<SourceFrame> next() override {
    if (ahead_.empty()) return source_->next();
    SourceFrame frame = std::move(ahead_.front());
    ahead_.pop_front();
    return frame;
  }

 private:
  std::deque<SourceFrame> ahead_;
  std::unique_ptr<FrameSource> source_;
};

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

FirstLook summarise(const std::deque<SourceFrame>& frames, const FrameSource& source) {
  FirstLook look;
  look.frames = frames.size();
  look.images = source.size();
  look.posed = source.posed();
  for (const auto& [reason, count] : source.skipped()) look.images_passed_over += count;
  if (frames.empty()) return look;
  const DepthFrame& first = frames.front().depth;
  look.width = first.width;
  look.height = first.height;
  look.intrinsics = first.intrinsics;
  look.units_per_metre = 1.0 / static_cast<double>(first.unit_m);
  size_t pixels = 0;
  for (const SourceFrame& frame : frames) {
    pixels += static_cast<size_t>(frame.depth.width) * static_cast<size_t>(frame.depth.height);
  }
  std::vector<float> depths_m = measuredDepths(frames);
  if (depths_m.empty()) return look;
  look.measured_share = static_cast<double>(depths_m.size()) / static_cast<double>(pixels);
  const auto middle = depths_m.begin() + static_cast<std::ptrdiff_t>(depths_m.size() / 2);
  std::nth_element(depths_m.begin(), middle, depths_m.end());
  look.median_depth_m = *middle;
  return look;
}

/// Three digits, and a unit that suits.
std::string inWords(double length_m) {
  if (length_m >= 1000.0) return formatted("%.3g km", length_m / 1000.0);
  if (length_m >= 0.01) return formatted("%.3g m", length_m);
  return formatted("%.3g mm", 1000.0 * length_m);
}

std::string inWords(const Intrinsics& K) {
  return formatted("fx %g, fy %g, cx %g, cy %g", static_cast<double>(K.fx),
                   static_cast<double>(K.fy), static_cast<double>(K.cx), static_cast<double>(K.cy));
}

/// A whole number as such: the unit behind it is rounded.
std::string unitsInWords(double units_per_metre) { return formatted("%.6g", units_per_metre); }

std::string imagesInWords(const FirstLook& look) {
  if (!look.images) return "images";
  return std::to_string(*look.images) + (*look.images == 1 ? " image" : " images");
}

/// ", 298 with a pose"; empty where nothing is known against them.
std::string describePoses(const FirstLook& look) {
  if (look.posed) return ", " + std::to_string(*look.posed) + " with a pose";
  if (look.images_passed_over == 0) return "";
  return ", " + std::to_string(look.images_passed_over) + " of the first " +
         std::to_string(look.frames + look.images_passed_over) + " skipped";
}

}  // namespace

LookedAt lookAt(std::unique_ptr<FrameSource> source, size_t frames) {
  std::deque<SourceFrame> ahead;
  while (ahead.size() < frames) {
    std::optional<SourceFrame> frame = source->next();
    if (!frame) break;
    ahead.push_back(std::move(*frame));
  }
  FirstLook look = summarise(ahead, *source);
  return {look, std::make_unique<FramesReadAhead>(std::move(ahead), std::move(source))};
}

std::string describe(const FirstLook& look) {
  if (look.frames == 0) return "no usable image";
  return imagesInWords(look) + " of " + std::to_string(look.width) + " x " +
         std::to_string(look.height) + " (" + inWords(look.intrinsics) + ")" + describePoses(look) +
         "; median depth " + (look.median_depth_m ? inWords(*look.median_depth_m) : "unknown") +
         ", " + std::to_string(std::lround(100.0 * look.measured_share)) +
         " % of the pixels measured";
}

std::vector<std::string> doubtsAbout(const FirstLook& look, double min_depth_m,
                                     double max_depth_m) {
  std::vector<std::string> doubts;
  if (look.frames == 0) return doubts;  // the run itself will say so
  const std::string which = "the first " + std::to_string(look.frames) + " images";
  const std::string camera = doubtAbout(look.intrinsics, look.width, look.height);
  if (!camera.empty()) doubts.push_back(camera);
  if (!look.median_depth_m) {
    doubts.push_back(which + " have no measured pixel: are these depth images?");
  } else if (look.measured_share < kFewPixels) {
    doubts.push_back("hardly any pixel of " + which + " is measured: are these depth images?");
  }
  if (look.median_depth_m &&
      (*look.median_depth_m < min_depth_m || *look.median_depth_m > max_depth_m)) {
    doubts.push_back("median depth " + inWords(*look.median_depth_m) + ": is the scale " +
                     unitsInWords(look.units_per_metre) + "? The mapped range is " +
                     inWords(min_depth_m) + " to " + inWords(max_depth_m) +
                     " (fusion/min_depth_m, fusion/max_depth_m)");
  }
  if (look.images && look.posed &&
      static_cast<double>(*look.posed) < kFewPoses * static_cast<double>(*look.images)) {
    doubts.push_back("only " + std::to_string(*look.posed) + " of " + std::to_string(*look.images) +
                     " images have a pose: do the stamps match?");
  }
  if (!look.posed && look.images_passed_over > look.frames) {
    doubts.push_back(std::to_string(look.images_passed_over) + " of the first " +
                     std::to_string(look.frames + look.images_passed_over) +
                     " images cannot be used: do stamps and frames match?");
  }
  return doubts;
}

}  // namespace dtsdf
