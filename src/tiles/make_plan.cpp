#include "tiles/make_plan.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>

#include "backend/frame_check.h"
#include "dtsdf_mapping/io/prefetched_frames.h"
#include "mapper/probed_mapper.h"
#include "program/progress_bar.h"
#include "program/stopwatch.h"
#include "tiles/make_tiles.h"
#include "tools/reconstruction.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

/// @throws std::runtime_error for settings whose rules look at all of the map.
void checkSettings(const MapperParams& params) {
  if (params.map.keep_radius_m > 0.0f) {
    throw std::runtime_error(
        "map/keep_radius_m depends on the whole map, so tiles cannot apply it; leave it at 0");
  }
}

/// @throws std::runtime_error where what an image paints depends on all of the map.
void checkPainting(const PaintParams& paint, const std::string& path) {
  if (paint.exposure == ImageExposure::kFixed && paint.max_depth_m > 0.0f) return;
  throw std::runtime_error(
      "'" + path +
      "' has colour images, which tiles need at a fixed exposure and with a depth "
      "limit: give --set colour/exposure=fixed colour/max_depth_m=5 (to reconstruct "
      "as well), or colour/enabled=never");
}

/// Sends the frames of all recordings through the mapper, and makes tiles of what they touch.
class Planner {
 public:
  Planner(const PlanRequest& request, const RunSettings& settings)
      : settings_(settings),
        params_(settings.params.mapper),
        colour_reach_(params_, settings.rules.colour) {
    checkSettings(params_);
    plan_.reading = request.reading;
    std::string& poses = plan_.reading.recording.poses_path;
    if (!poses.empty()) poses = std::filesystem::absolute(poses).lexically_normal().string();
    plan_.settings = settings.given;
    for (const char* key : {"backend", "threads"}) plan_.settings.erase(key);
    plan_.tile_m = request.tile_m;
    plan_.tile_blocks = std::max(1, static_cast<int>(std::lround(request.tile_m / blockSize_m())));
    mapper_ = makeProbedMapper(params_, settings.rules);
    mapper_->restrictTo({noBlocks(), noBlocks(), noBlocks()});
    openRecordings(request.recordings);
    ledger_.emplace(params_, placeBlocks(), request.recordings.size());
  }

  void readAll() {
    for (const InputOptions& input : inputs_) read(input);
  }

  Plan finish() {
    ledger_->close();
    const double frame_s = images_ > 0 ? image_seconds_ / static_cast<double>(images_) : 0.0;
    plan_.tiles =
        makeTiles({*ledger_, colour_images_, colour_reach_, params_, plan_.tile_blocks, frame_s});
    if (plan_.tiles.empty()) {
      throw std::runtime_error("no frame of the recordings shows a surface, so there are no tiles");
    }
    plan_.seconds = watch_.seconds();
    plan_.processor_s = processorSeconds();
    return std::move(plan_);
  }

 private:
  double blockSize_m() const { return static_cast<double>(params_.map.voxel_size_m) * kBlockSide; }

  /// Account is kept by tiles, or by smaller places where tiles fuse more than their own blocks, as
  /// painted ones do.
  int placeBlocks() const {
    const int blocks = plan_.tile_blocks;
    return has_colour_ ? std::max(blocks / 4, std::min(blocks, 4)) : blocks;
  }

  /// Before any is read: what is wrong with the last one is to show now.
  void openRecordings(const std::vector<std::string>& paths) {
    for (const std::string& path : paths) {
      InputOptions input = plan_.reading;
      input.recording.path = std::filesystem::absolute(path).lexically_normal().string();
      completeInput(input);
      if (openColours(input, settings_.params.node) != nullptr) {
        checkPainting(params_.paint, path);
        has_colour_ = true;
      }
      inputs_.push_back(input);
    }
  }

  void read(const InputOptions& input) {
    plan_.recordings.push_back({input.recording.path, input.recording.format, {}, {}, {}});
    frames_of_recording_ = 0;
    auto frames = openAndLook(input, settings_, "tiles");
    if (&input == &inputs_.front()) plan_.T_W_M = findLevel(input, settings_, "tiles");
    const auto source = prefetchFrames(levelled(std::move(frames), plan_.T_W_M));
    const auto colours = levelled(openColours(input, settings_.params.node), plan_.T_W_M);
    plan_.map_frame = nameOfFrame(input, settings_);
    ProgressBar progress("frames", source->size());
    size_t done = 0;
    RecordedInput recorded(*source, colours.get(), settings_.params.node.colour.max_rate_hz);
    if (has_frames_) recorded.map_stamp_s = plan_.stamp_s;
    InputVisitor visitor;
    visitor.fuse = [&](const SourceFrame& frame) { take(frame); };
    visitor.paint = [&](const SourceColour& image) { take(image); };
    visitor.finish_frame = [&] { progress.show(++done); };
    visitInput(recorded, visitor);
  }

  void take(const SourceFrame& frame) {
    const Stopwatch watch;
    const IntegrationResult result = mapper_->integrate(frame.depth);
    image_seconds_ += watch.seconds();
    ++images_;
    if (result.status == FrameStatus::kNoMemory) throw std::runtime_error(result.message);
    if (result.status != FrameStatus::kFused) return;
    PlannedRecording& recording = plan_.recordings.back();
    const std::vector<BlockRequest>& touched = mapper_->outsideExtent();
    recording.fused.add(frame.index);
    if (!touched.empty()) recording.supporting.add(frame.index);
    ++frames_of_recording_;
    has_frames_ = true;
    plan_.stamp_s = frame.stamp_s;
    ledger_->add(frame.depth, {plan_.recordings.size() - 1, frame.index}, touched);
  }

  void take(const SourceColour& image) {
    if (findProblem(image.colour, params_)) return;
    plan_.recordings.back().images.push_back({image.index, frames_of_recording_});
    colour_images_.push_back(
        {{plan_.recordings.size() - 1, image.index}, PinholeView(image.colour)});
  }

  const RunSettings settings_;
  const MapperParams params_;
  const Stopwatch watch_;
  const ColourReach colour_reach_;
  std::vector<InputOptions> inputs_;
  bool has_colour_ = false;
  Plan plan_;
  std::unique_ptr<ProbedMapper> mapper_;
  std::optional<FrameLedger> ledger_;
  std::vector<ImageInWork> colour_images_;
  size_t frames_of_recording_ = 0;  ///< Fused, of the one that is read.
  bool has_frames_ = false;         ///< Of any recording.
  double image_seconds_ = 0.0;
  size_t images_ = 0;
};

}  // namespace

Plan makePlan(const PlanRequest& request, const RunSettings& settings) {
  if (request.recordings.size() > 1 && !request.reading.recording.poses_path.empty()) {
    throw UsageError("--poses works with one recording only");
  }
  Planner planner(request, settings);
  planner.readAll();
  return planner.finish();
}

}  // namespace dtsdf
