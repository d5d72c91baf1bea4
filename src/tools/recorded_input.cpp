#include "tools/recorded_input.h"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <stdexcept>
#include <utility>

#include "io/bag_frames.h"
#include "io/wrapped_images.h"
#include "journal/replay.h"
#include "level/floor.h"
#include "level/frame_points.h"
#include "level/level_pose.h"
#include "params/intrinsics_check.h"
#include "params/text.h"
#include "tools/reconstruction.h"

namespace dtsdf {
namespace {

/// Number of images that are inspected, and the grid of pixels sampled in each.
constexpr size_t kInspectedFrames = 5;
constexpr int kColumns = 64, kRows = 48;
/// Minimum fraction of measured pixels; with fewer, the images are probably not depth images.
constexpr double kMinMeasuredShare = 0.05;

BagOptions bagOptions(const RunOptions& options, const NodeParams& node) {
  BagOptions bag = options.recording;
  bag.map_frame = node.map_frame;
  bag.input = node.input;
  if (node.input.mask && bag.mask_topic.empty()) {
    throw UsageError("input/mask requires masks; give the bag's topic with --mask-topic");
  }
  return bag;
}

/// Converts depth along rays to depth along the optical axis.
void convertRayDepth(SourceFrame& frame) {
  if (frame.depth.data == nullptr) return;
  const auto pixels = std::make_shared<std::vector<float>>(static_cast<size_t>(frame.depth.width) *
                                                           static_cast<size_t>(frame.depth.height));
  rayToAxialDepth(frame.depth, pixels->data());
  frame.pixels = pixels;
}

std::unique_ptr<FrameSource> openSource(const RunOptions& options, const NodeParams& node) {
  if (options.recording.format == "bag") return openBagFrames(bagOptions(options, node));
  if (options.recording.format == "journal") {
    throw std::runtime_error(
        "'" + options.recording.path +
        "' is a journal; use reconstruct, map_tool export or map_tool texture");
  }
  return openRecording(options.recording);
}

}  // namespace

void completeInput(RunOptions& options) {
  std::string& format = options.recording.format;
  if (format.empty()) {
    const std::string& path = options.recording.path;
    format = isJournal(path) ? "journal" : guessRecordingFormat(path);
  }
  checkReadingOptions(options);
}

std::unique_ptr<FrameSource> openFrames(const RunOptions& options, const NodeParams& node) {
  std::unique_ptr<FrameSource> source = openSource(options, node);
  if (!node.input.depth_along_ray || options.recording.format == "bag") return source;
  return changed(std::move(source), convertRayDepth);
}

namespace {

/// Prints statistics of the first images of a source, and warns if they are implausible.
void reportOn(const std::deque<SourceFrame>& frames, const FrameSource& source,
              const RecordingOptions& recording, const FusionParams& fusion) {
  std::vector<double> depths_m;
  for (const SourceFrame& frame : frames) {
    for (const auto& p_C : thinnedPoints(frame.depth, kColumns, kRows)) depths_m.push_back(p_C.z());
  }
  const double share =
      static_cast<double>(depths_m.size()) / static_cast<double>(frames.size() * kColumns * kRows);
  const auto middle = depths_m.begin() + static_cast<std::ptrdiff_t>(depths_m.size() / 2);
  std::nth_element(depths_m.begin(), middle, depths_m.end());
  const double median_m = depths_m.empty() ? 0.0 : *middle;
  const DepthFrame& first = frames.front().depth;
  const std::optional<size_t> images = source.size(), posed = source.posed();
  const std::string skipped = describeSkipped(source.skipped(), source.problems());
  std::printf("%s: %simages of %d x %d (%s)%s%s; median depth %s, %.0f %% of the pixels measured\n",
              recording.format.c_str(), images ? formatted("%zu ", *images).c_str() : "",
              first.width, first.height, inWords(first.intrinsics).c_str(),
              posed ? formatted(", %zu with a pose", *posed).c_str() : "",
              skipped.empty() ? "" : (", skipped so far: " + skipped).c_str(),
              depths_m.empty() ? "unknown" : formatted("%.4g m", median_m).c_str(), 100.0 * share);
  const std::string assumed = recording.format != "bag" ? assumptionsOf(recording) : "";
  if (!assumed.empty()) std::printf("assumed: %s\n", assumed.c_str());
  static_cast<void>(std::fflush(stdout));  // files and pipes are buffered, and the run is long
  const auto warn = [](const std::string& what) {
    if (!what.empty()) std::fprintf(stderr, "reconstruct: warning: %s\n", what.c_str());
  };
  warn(doubtAbout(first.intrinsics, first.width, first.height));
  const double min_m = fusion.min_depth_m, max_m = fusion.max_depth_m;
  if (share < kMinMeasuredShare) {
    warn("the first images contain almost no measured pixels: are these depth images?");
  } else if (median_m < min_m || median_m > max_m) {
    warn(formatted(
        "median depth %.4g m is outside the mapped range, %g to %g m (fusion/min_depth_m, "
        "fusion/max_depth_m): is %.6g units per metre the right scale?",
        median_m, min_m, max_m, 1.0 / double{first.unit_m}));
  }
}

}  // namespace

std::unique_ptr<FrameSource> openAndInspect(const RunOptions& options,
                                            const RunSettings& settings) {
  auto source = openFrames(options, settings.params);
  std::deque<SourceFrame> ahead;
  while (ahead.size() < kInspectedFrames) {
    std::optional<SourceFrame> frame = source->next();
    if (!frame) break;
    ahead.push_back(std::move(*frame));
  }
  if (ahead.empty()) return source;  // the run will end with an error
  reportOn(ahead, *source, options.recording, settings.params.mapper.fusion);
  return std::make_unique<WrappedImages<SourceFrame>>(
      std::move(source), [ahead = std::move(ahead)](FrameSource& images) mutable {
        if (ahead.empty()) return images.next();
        std::optional<SourceFrame> frame = std::move(ahead.front());
        ahead.pop_front();
        return frame;
      });
}

Eigen::Vector3d measuredUp(const RunOptions& options, const NodeParams& node) {
  if (options.recording.format == "bag") return findUpInBag(bagOptions(options, node));
  throw std::runtime_error("map/level is imu, which needs a bag with IMU data; '" +
                           options.recording.path + "' is read as " + options.recording.format +
                           ": set map/level to floor or none");
}

std::string nameOfFrame(const RunOptions& options, const RunSettings& settings) {
  const bool is_named = options.recording.format == "bag" || settings.given.count("map_frame") > 0;
  return is_named ? settings.params.map_frame : std::string();
}

std::unique_ptr<ColourSource> openColours(const RunOptions& options, const NodeParams& node) {
  if (node.colour == Usage::kNever) return nullptr;
  const RecordingOptions& recording = options.recording;
  std::unique_ptr<ColourSource> colours = recording.format == "bag"
                                              ? openBagColours(bagOptions(options, node))
                                              : openRecordingColours(recording);
  if (colours == nullptr && node.colour == Usage::kAlways) {
    throw std::runtime_error("colour/enabled is 'always', but no colour images were found in '" +
                             recording.path + "', which is read as " + recording.format +
                             "; select a bag's topic with --color-topic, or set colour/enabled to "
                             "auto");
  }
  return colours;
}

namespace {

/// Maximum number of frames that are searched for the floor: ten seconds at 30 Hz.
constexpr size_t kFramesSearched = 300;

Eigen::Isometry3d levelByFloor(FrameSource& source, const std::string& path) {
  FloorSearch search;
  size_t looked_at = 0;
  while (!search.floor() && looked_at < kFramesSearched) {
    const std::optional<SourceFrame> frame = source.next();
    if (!frame) break;
    search.add(frame->depth);
    ++looked_at;
  }
  search.finish();
  if (search.floor()) return levelPose(*search.floor());
  throw std::runtime_error("map/level is floor, but the first " + std::to_string(looked_at) +
                           " images of '" + path + "' contain no floor (" + search.problem() +
                           "); start where the floor is in view, with --frames FIRST:, or set "
                           "map/level to none");
}

}  // namespace

std::optional<Eigen::Isometry3d> detectLevel(const RunOptions& options,
                                             const RunSettings& settings) {
  const NodeParams& node = settings.params;
  switch (node.level) {
    case LevelChoice::kFloor:
      return levelByFloor(*openFrames(options, node), options.recording.path);
    case LevelChoice::kImu: return levelPose(measuredUp(options, node));
    case LevelChoice::kNone: break;
  }
  return std::nullopt;
}

std::optional<Eigen::Isometry3d> findLevel(const RunOptions& options, const RunSettings& settings) {
  std::optional<Eigen::Isometry3d> T_W_M = detectLevel(options, settings);
  if (T_W_M) std::printf("levelled: %s\n", describeLevel(*T_W_M).c_str());
  return T_W_M;
}

std::unique_ptr<FrameSource> levelled(std::unique_ptr<FrameSource> source,
                                      const std::optional<Eigen::Isometry3d>& T_W_M) {
  if (!T_W_M) return source;
  return changed(std::move(source), [T_W_M = *T_W_M](SourceFrame& frame) {
    frame.depth.T_W_C = T_W_M * frame.depth.T_W_C;
  });
}

std::unique_ptr<ColourSource> levelled(std::unique_ptr<ColourSource> source,
                                       const std::optional<Eigen::Isometry3d>& T_W_M) {
  if (!T_W_M || source == nullptr) return source;
  return changed(std::move(source), [T_W_M = *T_W_M](SourceColour& image) {
    image.colour.T_W_C = T_W_M * image.colour.T_W_C;
  });
}

}  // namespace dtsdf
