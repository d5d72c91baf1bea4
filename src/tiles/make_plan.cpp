#include "tiles/make_plan.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "dtsdf_mapping/io/prefetched_frames.h"
#include "mapper/probed_mapper.h"
#include "program/progress_bar.h"
#include "tiles/colour_reach.h"
#include "tiles/process_usage.h"
#include "tiles/view_reach.h"
#include "tools/reconstruction.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kFramesAhead = 4;

/// What a block that a frame touches costs in casting, folding and clearing, on one core; what an
/// image costs is measured by the plan itself. (redkitchen at 20 mm.)
constexpr double kBlockSeconds = 10e-6;
/// What a colour image costs, on one core. (redkitchen.)
constexpr double kImageSeconds = 20e-3;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// @throws std::runtime_error for settings whose rules look at all of the map.
void checkSettings(const MapperParams& params) {
  if (params.map.keep_radius_m > 0.0f) {
    throw std::runtime_error(
        "map/keep_radius_m drops the farthest blocks of the whole map, which a tile does not know; "
        "leave it at 0 for a map in tiles");
  }
}

/// @throws std::runtime_error where what an image paints depends on all of the map.
void checkPainting(const PaintParams& paint, const std::string& path) {
  if (paint.exposure == ImageExposure::kFixed && paint.max_depth_m > 0.0f) return;
  throw std::runtime_error(
      "'" + path + "' has colour images, and a tile can be painted only if it is known how far "
      "they reach, and if their exposure is not found from all of the map: --set "
      "colour/exposure=fixed colour/max_depth_m=5, for reconstruct as well, or "
      "colour/enabled=never for a map without colour");
}

/// A box of blocks that frames have come by.
struct PlaceInWork {
  std::vector<IndexRanges> frames;   ///< By recording: that touch it, halo included, or clear it.
  std::vector<IndexRanges> passing;  ///< By recording: that may see its cells free.
  size_t touched_blocks = 0;         ///< By all frames, without halo.
  bool is_touched = false;           ///< Halo included.
  std::vector<BlockRequest> blocks;  ///< Of the whole map, without halo; in the end.
};

/// A colour image that paints.
struct ImageInWork {
  size_t recording, index;
  PinholeView view;
};

/// The frames of all recordings, the blocks that they touch, and the tiles that these lie in. It
/// keeps account by places, boxes of a grid: those of the tiles, or finer ones where tiles fuse
/// more than their own blocks, as painted ones do.
class Planner {
 public:
  Planner(const PlanRequest& request, const RunSettings& settings)
      : settings_(settings),
        params_(settings.params.mapper),
        start_(Clock::now()),
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
    recording_count_ = request.recordings.size();
    openRecordings(request.recordings);
    place_blocks_ = plan_.tile_blocks;
    if (has_colour_) place_blocks_ = std::max(place_blocks_ / 4, std::min(place_blocks_, 4));
  }

  void readAll() {
    for (const InputOptions& input : inputs_) read(input);
  }

  Plan finish() {
    plan_.tiles = makeTiles();
    if (plan_.tiles.empty()) {
      throw std::runtime_error("no frame of the recordings shows a surface, so there are no tiles");
    }
    plan_.seconds = secondsSince(start_);
    plan_.processor_s = processorSeconds();
    return std::move(plan_);
  }

 private:
  /// Numbers of a box of a grid along the axes.
  using Place = std::array<int32_t, 3>;

  double blockSize_m() const {
    return static_cast<double>(params_.map.voxel_size_m) * kBlockSide;
  }

  /// Before any is read: what is wrong with the last one is to be told now.
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
    const auto source = prefetchFrames(openAndLook(input, settings_, "tiles"), kFramesAhead);
    const auto colours = openColours(input, settings_.params.node);
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
    const Clock::time_point start = Clock::now();
    const IntegrationResult result = mapper_->integrate(frame.depth);
    image_seconds_ += secondsSince(start);
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
    for (const BlockRequest& block : touched) touch(block, frame.index);
    if (needsFreeDepth(params_)) lookThrough(frame);
  }

  void take(const SourceColour& image) {
    if (findProblem(image.colour, params_)) return;
    plan_.recordings.back().images.push_back({image.index, frames_of_recording_});
    colour_images_.push_back(
        {plan_.recordings.size() - 1, image.index, PinholeView(image.colour)});
  }

  void touch(const BlockRequest& block, size_t frame) {
    blocks_[block.key] |= block.directions;
    const BlockKey key = unpackKey(block.key);
    ++places_[placeOf(key)].touched_blocks;
    // Of the places that the block belongs to, halo included.
    const BlockExtent near{key - Vec3i{kHaloBehind, kHaloBehind, kHaloBehind},
                           key + Vec3i{kHaloBefore, kHaloBefore, kHaloBefore}};
    visitGrid(near, place_blocks_, [&](const Place& place) {
      PlaceInWork& in_work = places_[place];
      in_work.is_touched = true;
      ofRecording(in_work.frames).add(frame);
    });
  }

  /// A frame that touches nothing of a place may clear what is there already, and see cells free.
  void lookThrough(const SourceFrame& frame) {
    const ViewReach reach(frame.depth, params_);
    if (clearsFreeSpace(params_)) {
      for (auto& [place, in_work] : places_) {
        if (!in_work.is_touched) continue;
        IndexRanges& frames = ofRecording(in_work.frames);
        if (frames.contains(frame.index)) continue;
        if (reach.mayPass(boxOfFeet(withHalo(extentOf(place))))) frames.add(frame.index);
      }
    }
    if (params_.space.enabled) seeFree(reach, frame.index);
  }

  /// Notes the places whose cells a frame may see free.
  void seeFree(const ViewReach& reach, size_t frame) {
    const auto range_m = static_cast<double>(params_.space.max_range_m);
    BlockExtent view = blocksIn(reach.boundsUpTo(range_m), blockSize_m());
    const int beyond = blocksPerCube(params_.space.cell_voxels);
    view.first = view.first - Vec3i{beyond, beyond, beyond};
    visitGrid(view, place_blocks_, [&](const Place& place) {
      const BlockExtent cells = withCubes(extentOf(place), params_.space.cell_voxels);
      const double margin_m = static_cast<double>(params_.map.voxel_size_m);
      if (!reach.mayPass(boxOf(cells, blockSize_m(), margin_m))) return;
      ofRecording(places_[place].passing).add(frame);
    });
  }

  /// That of the recording that is read.
  IndexRanges& ofRecording(std::vector<IndexRanges>& frames) const {
    frames.resize(recording_count_);
    return frames[plan_.recordings.size() - 1];
  }

  Place placeOf(const BlockKey& key) const {
    const auto at = [this](int32_t x) { return floorDivided(x, place_blocks_); };
    return {at(key.z), at(key.y), at(key.x)};
  }

  /// Calls visit(place) for the boxes of a grid that have something of an extent.
  template <class Visit>
  static void visitGrid(const BlockExtent& extent, int edge, const Visit& visit) {
    const auto at = [edge](int32_t x) { return floorDivided(x, edge); };
    for (int32_t z = at(extent.first.z); z <= at(extent.last.z); ++z) {
      for (int32_t y = at(extent.first.y); y <= at(extent.last.y); ++y) {
        for (int32_t x = at(extent.first.x); x <= at(extent.last.x); ++x) visit(Place{z, y, x});
      }
    }
  }

  static BlockExtent boxOfGrid(const Place& place, int edge) {
    const BlockKey first{place[2] * edge, place[1] * edge, place[0] * edge};
    return {first, {first.x + edge - 1, first.y + edge - 1, first.z + edge - 1}};
  }
  BlockExtent extentOf(const Place& place) const { return boxOfGrid(place, place_blocks_); }

  /// What feet of voxels may lie in: they are as far from them as the truncation.
  MetricBox boxOfFeet(const BlockExtent& extent) const {
    const double margin_m =
        static_cast<double>(params_.map.voxel_size_m * (params_.map.truncation_voxels + 2.0f));
    return boxOf(extent, blockSize_m(), margin_m);
  }

  std::vector<Tile> makeTiles() {
    for (const auto& [key, directions] : blocks_) {
      places_[placeOf(unpackKey(key))].blocks.push_back({key, directions});
    }
    std::set<Place> of_tiles;
    for (const auto& [place, in_work] : places_) {
      if (in_work.blocks.empty() && in_work.passing.empty()) continue;
      visitGrid(extentOf(place), plan_.tile_blocks,
                [&](const Place& tile) { of_tiles.insert(tile); });
    }
    const MemoryBudget budget = budgetOf(params_);
    std::vector<Tile> tiles;
    for (const Place& place : of_tiles) {
      const std::vector<Tile> parts =
          cutToBudget(boxOfGrid(place, plan_.tile_blocks), budget,
                      [this](const BlockExtent& own) { return describe(own); });
      tiles.insert(tiles.end(), parts.begin(), parts.end());
    }
    return tiles;
  }

  /// A tile, and what it needs.
  Tile describe(const BlockExtent& own) const {
    Tile tile;
    tile.own = own;
    tile.fused = withHalo(own);
    tile.frames.resize(recording_count_);
    tile.images.resize(recording_count_);
    visitPlaces(own, [&](const BlockExtent&, const PlaceInWork& in_work) {
      for (const BlockRequest& block : in_work.blocks) {
        tile.estimate.own_blocks += own.contains(unpackKey(block.key));
      }
    });
    if (tile.estimate.own_blocks > 0) addImages(tile);
    addFrames(tile);
    estimateSize(tile);
    const double per_image_s = images_ > 0 ? image_seconds_ / static_cast<double>(images_) : 0.0;
    tile.estimate.seconds += static_cast<double>(tile.frameCount()) * per_image_s +
                             static_cast<double>(tile.imageCount()) * kImageSeconds;
    return tile;
  }

  void addImages(Tile& tile) const {
    const BlockExtent painted = withHalo(tile.own);
    for (const ImageInWork& image : colour_images_) {
      if (!colour_reach_.mayPaint(image.view, painted)) continue;
      tile.images[image.recording].add(image.index);
      tile.fused = around(tile.fused, colour_reach_.blocksFor(image.view, painted));
    }
  }

  /// Frames of a place are those of its halo, too.
  void addFrames(Tile& tile) const {
    const BlockExtent inner{
        tile.fused.first + Vec3i{kHaloBefore, kHaloBefore, kHaloBefore},
        tile.fused.last - Vec3i{kHaloBehind, kHaloBehind, kHaloBehind}};
    std::vector<const PlaceInWork*> fusing, passed;
    visitPlaces(inner, [&](const BlockExtent& extent, const PlaceInWork& in_work) {
      fusing.push_back(&in_work);
      if (overlap(extent, tile.own)) passed.push_back(&in_work);
      tile.estimate.seconds += static_cast<double>(in_work.touched_blocks) * kBlockSeconds;
    });
    for (size_t recording = 0; recording < recording_count_; ++recording) {
      std::vector<const IndexRanges*> parts;
      const auto add = [&](const std::vector<IndexRanges>& frames) {
        if (recording < frames.size()) parts.push_back(&frames[recording]);
      };
      for (const PlaceInWork* place : fusing) add(place->frames);
      for (const PlaceInWork* place : passed) add(place->passing);
      tile.frames[recording] = IndexRanges::unite(parts);
    }
  }

  void estimateSize(Tile& tile) const {
    TileEstimate& estimate = tile.estimate;
    const BlockExtent painted = withHalo(tile.own);
    size_t painted_arrays = 0;
    visitPlaces(tile.fused, [&](const BlockExtent& extent, const PlaceInWork& in_work) {
      if (!in_work.passing.empty()) estimate.free_bytes += freeBytesIn(tile.own, extent);
      for (const BlockRequest& block : in_work.blocks) {
        const BlockKey key = unpackKey(block.key);
        if (!tile.fused.contains(key)) continue;
        const auto arrays = static_cast<size_t>(__builtin_popcount(block.directions));
        ++estimate.blocks;
        estimate.voxel_arrays += arrays;
        if (tile.imageCount() > 0 && painted.contains(key)) painted_arrays += arrays;
      }
    });
    estimate.map_bytes = estimate.blocks * BlockTable::kBlockBytes +
                         estimate.voxel_arrays * BlockTable::kArrayBytes +
                         painted_arrays * kBricksPerArray * BlockTable::kColourBytes;
  }

  /// Of the cubes of a tile that begin in an extent, at most.
  size_t freeBytesIn(const BlockExtent& own, const BlockExtent& extent) const {
    const BlockExtent cubes = cubesOf(inBoth(own, extent), params_.space.cell_voxels);
    size_t count = 1;
    for (const int32_t edge : {cubes.last.x - cubes.first.x, cubes.last.y - cubes.first.y,
                               cubes.last.z - cubes.first.z}) {
      count *= static_cast<size_t>(std::max(edge + 1, 0));
    }
    return count * kFreeCubeBudgetBytes;
  }

  /// Calls visit(extent, place) for the places with something of an extent that frames came by.
  template <class Visit>
  void visitPlaces(const BlockExtent& extent, const Visit& visit) const {
    double boxes = 1.0;
    for (const int32_t edge : {extent.last.x - extent.first.x, extent.last.y - extent.first.y,
                               extent.last.z - extent.first.z}) {
      boxes *= 2.0 + static_cast<double>(edge) / place_blocks_;
    }
    if (boxes > static_cast<double>(places_.size())) {
      for (const auto& [place, in_work] : places_) {
        if (overlap(extentOf(place), extent)) visit(extentOf(place), in_work);
      }
      return;
    }
    visitGrid(extent, place_blocks_, [&](const Place& place) {
      const auto found = places_.find(place);
      if (found != places_.end()) visit(extentOf(place), found->second);
    });
  }

  const RunSettings settings_;
  const MapperParams params_;
  const Clock::time_point start_;
  const ColourReach colour_reach_;
  size_t recording_count_;
  std::vector<InputOptions> inputs_;
  bool has_colour_ = false;
  int place_blocks_;
  Plan plan_;
  std::unique_ptr<ProbedMapper> mapper_;
  std::unordered_map<PackedKey, uint32_t> blocks_;  ///< Directions of those that were touched.
  std::map<Place, PlaceInWork> places_;
  std::vector<ImageInWork> colour_images_;
  size_t frames_of_recording_ = 0;  ///< Fused, of the one that is read.
  bool has_frames_ = false;         ///< Of any recording.
  double image_seconds_ = 0.0;
  size_t images_ = 0;
};

/// Two halves, across the longest edge.
std::array<BlockExtent, 2> halvesOf(const BlockExtent& extent) {
  const auto length = [](int32_t first, int32_t last) { return last - first; };
  const int32_t x = length(extent.first.x, extent.last.x);
  const int32_t y = length(extent.first.y, extent.last.y);
  const int32_t z = length(extent.first.z, extent.last.z);
  std::array<BlockExtent, 2> halves{extent, extent};
  int32_t BlockKey::*const axis =
      x >= y && x >= z ? &BlockKey::x : (y >= z ? &BlockKey::y : &BlockKey::z);
  const int32_t middle = extent.first.*axis + (extent.last.*axis - extent.first.*axis) / 2;
  halves[0].last.*axis = middle;
  halves[1].first.*axis = middle + 1;
  return halves;
}

bool isOneBlock(const BlockExtent& extent) {
  return extent.first.x == extent.last.x && extent.first.y == extent.last.y &&
         extent.first.z == extent.last.z;
}

}  // namespace

std::vector<Tile> cutToBudget(const BlockExtent& own, const MemoryBudget& budget,
                              const std::function<Tile(const BlockExtent&)>& describe) {
  const Tile whole = describe(own);
  const TileEstimate& estimate = whole.estimate;
  if (estimate.own_blocks == 0 && estimate.free_bytes == 0) return {};
  if (estimate.map_bytes <= budget.map_bytes && estimate.free_bytes <= budget.free_bytes) {
    return {whole};
  }
  if (isOneBlock(own)) {
    throw std::runtime_error(
        "a block and those that are fused with it take more than map/max_memory_mb; raise it, or, "
        "where there is colour, lower colour/max_depth_m");
  }
  std::vector<Tile> parts;
  for (const BlockExtent& half : halvesOf(own)) {
    const std::vector<Tile> cut = cutToBudget(half, budget, describe);
    parts.insert(parts.end(), cut.begin(), cut.end());
  }
  return parts;
}

Plan makePlan(const PlanRequest& request, const RunSettings& settings) {
  if (request.recordings.size() > 1 && !request.reading.recording.poses_path.empty()) {
    throw UsageError("--poses is for one recording, and there are several");
  }
  Planner planner(request, settings);
  planner.readAll();
  return planner.finish();
}

}  // namespace dtsdf
