#include "tools/levelled_input.h"

#include <cstdio>
#include <stdexcept>
#include <utility>

#include "level/floor_search.h"
#include "level/level_doubt.h"
#include "level/level_pose.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

/// Ten seconds of most cameras.
constexpr size_t kFramesSearched = 300;

class LevelledFrames : public FrameSource {
 public:
  LevelledFrames(std::unique_ptr<FrameSource> source, const Eigen::Isometry3d& T_W_M)
      : source_(std::move(source)), T_W_M_(T_W_M) {}

  std::optional<size_t> size() const override { return source_->size(); }
  std::optional<size_t> posed() const override { return source_->posed(); }
  const std::map<std::string, size_t>& skipped() const override { return source_->skipped(); }

  std::optional<SourceFrame> next() override {
    std::optional<SourceFrame> frame = source_->next();
    if (frame) frame->depth.T_W_C = T_W_M_ * frame->depth.T_W_C;
    return frame;
  }

 private:
  std::unique_ptr<FrameSource> source_;
  const Eigen::Isometry3d T_W_M_;
};

class LevelledColours : public ColourSource {
 public:
  LevelledColours(std::unique_ptr<ColourSource> source, const Eigen::Isometry3d& T_W_M)
      : source_(std::move(source)), T_W_M_(T_W_M) {}

  const std::map<std::string, size_t>& skipped() const override { return source_->skipped(); }

  std::optional<SourceColour> next() override {
    std::optional<SourceColour> image = source_->next();
    if (image) image->colour.T_W_C = T_W_M_ * image->colour.T_W_C;
    return image;
  }

 private:
  std::unique_ptr<ColourSource> source_;
  const Eigen::Isometry3d T_W_M_;
};

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
  if (search.floor()) return levelPose(search.floor()->normal, search.floor()->offset_m);
  throw std::runtime_error("map/level is floor, but the first " + std::to_string(looked_at) +
                           " images of '" + path + "' show none (" + search.problem() +
                           "); start where it is in view, with --frames FIRST:, or set map/level "
                           "to none");
}

/// Heights of free space mean nothing unless z is up.
void warnIfNotLevel(FrameSource& source, const std::string& program) {
  LevelDoubt doubt;
  for (size_t i = 0; i < FloorSearch::kViews; ++i) {
    const std::optional<SourceFrame> frame = source.next();
    if (!frame || doubt.add(frame->depth)) break;
  }
  doubt.finish();
  if (doubt.text().empty()) return;
  std::fprintf(stderr, "%s: warning: %s\n", program.c_str(), doubt.text().c_str());
}

std::optional<Eigen::Isometry3d> lookForLevel(const InputOptions& options,
                                              const RunSettings& settings,
                                              const std::string& program) {
  const NodeParams& node = settings.params.node;
  switch (node.level.from) {
    case LevelChoice::kFloor:
      return levelByFloor(*openFrames(options, node), options.recording.path);
    case LevelChoice::kImu: return levelPose(measuredUp(options, node));
    case LevelChoice::kNone: break;
  }
  if (settings.params.mapper.space.enabled) warnIfNotLevel(*openFrames(options, node), program);
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Isometry3d> findLevel(const InputOptions& options, const RunSettings& settings,
                                           const std::string& program) {
  const std::optional<Eigen::Isometry3d> T_W_M = lookForLevel(options, settings, program);
  if (T_W_M) std::printf("levelled: %s\n", describeLevel(*T_W_M).c_str());
  return T_W_M;
}

std::unique_ptr<FrameSource> levelled(std::unique_ptr<FrameSource> source,
                                      const std::optional<Eigen::Isometry3d>& T_W_M) {
  if (!T_W_M) return source;
  return std::make_unique<LevelledFrames>(std::move(source), *T_W_M);
}

std::unique_ptr<ColourSource> levelled(std::unique_ptr<ColourSource> source,
                                       const std::optional<Eigen::Isometry3d>& T_W_M) {
  if (!T_W_M || source == nullptr) return source;
  return std::make_unique<LevelledColours>(std::move(source), *T_W_M);
}

}  // namespace dtsdf
