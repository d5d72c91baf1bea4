#include "tiles/make_plan.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <unordered_map>

#include "backend/rule_settings.h"
#include "dtsdf_mapping/io/prefetched_frames.h"
#include "mapper/probed_mapper.h"
#include "program/progress_bar.h"
#include "tiles/process_usage.h"
#include "tiles/view_reach.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kFramesAhead = 4;

/// What a block that a frame touches costs in casting, folding and clearing, on one core; what an
/// image costs is measured by the plan itself. (redkitchen at 20 mm.)
constexpr double kBlockSeconds = 10e-6;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

int32_t floorDivided(int32_t a, int32_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

/// @throws std::runtime_error for settings whose rules look at all of the map.
void checkSettings(const MapperParams& params) {
  if (params.map.keep_radius_m > 0.0f) {
    throw std::runtime_error(
        "map/keep_radius_m drops the farthest blocks of the whole map, which a tile does not know; "
        "leave it at 0 for a map in tiles");
  }
  if (params.space.enabled) {
    throw std::runtime_error(
        "space/enabled asks for what is free around all surfaces, and a tile is given only the "
        "frames that show its own; leave it off for a map in tiles");
  }
}

/// A tile that frames have come by.
struct TileInWork {
  std::vector<IndexRanges> frames;
  size_t touched_blocks = 0;  ///< By all frames.
};

/// The frames of all recordings, the blocks that they touch, and the tiles that these lie in.
class Planner {
 public:
  Planner(const PlanRequest& request, const RunSettings& settings)
      : settings_(settings), params_(settings.params.mapper), start_(Clock::now()) {
    checkSettings(params_);
    plan_.reading = request.reading;
    std::string& poses = plan_.reading.recording.poses_path;
    if (!poses.empty()) poses = std::filesystem::absolute(poses).lexically_normal().string();
    plan_.settings = settings.given;
    for (const char* key : {"backend", "threads"}) plan_.settings.erase(key);
    plan_.tile_m = request.tile_m;
    plan_.tile_blocks = std::max(1, static_cast<int>(std::lround(request.tile_m / blockSize_m())));
    mapper_ = makeProbedMapper(params_, settings.rules);
    mapper_->restrictTo(noBlocks());
    recording_count_ = request.recordings.size();
  }

  void read(const std::string& path) {
    InputOptions input = plan_.reading;
    input.recording.path = std::filesystem::absolute(path).lexically_normal().string();
    completeInput(input);
    if (openColours(input, settings_.params.node) != nullptr) refuseColour(path);
    plan_.recordings.push_back({input.recording.path, input.recording.format, {}, {}});
    const auto source = prefetchFrames(openAndLook(input, settings_, "tiles"), kFramesAhead);
    plan_.map_frame = nameOfFrame(input, settings_);
    ProgressBar progress("frames", source->size());
    size_t done = 0;
    while (const std::optional<SourceFrame> frame = source->next()) {
      take(*frame);
      progress.show(++done);
    }
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
  /// Numbers of a tile along the axes.
  using Place = std::array<int32_t, 3>;

  double blockSize_m() const {
    return static_cast<double>(params_.map.voxel_size_m) * kBlockSide;
  }

  [[noreturn]] static void refuseColour(const std::string& path) {
    throw std::runtime_error(
        "'" + path + "' has colour images, and a map in tiles cannot be painted: what hides a "
        "surface, and the exposure of an image, are found from all of the map; --set "
        "colour/enabled=never makes the map without colour");
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
    plan_.stamp_s = frame.stamp_s;
    for (const BlockRequest& block : touched) touch(block, frame.index);
    if (clearsFreeSpace(params_)) lookThrough(frame);
  }

  void touch(const BlockRequest& block, size_t frame) {
    blocks_[block.key] |= block.directions;
    const BlockKey key = unpackKey(block.key);
    visitTilesAround(key, [&](const Place& place) {
      TileInWork& tile = tiles_[place];
      framesOf(tile).add(frame);
      ++tile.touched_blocks;
    });
  }

  /// A frame that touches nothing of a tile may clear what is there already.
  void lookThrough(const SourceFrame& frame) {
    const ViewReach reach(frame.depth, params_);
    for (auto& [place, tile] : tiles_) {
      IndexRanges& frames = framesOf(tile);
      if (frames.contains(frame.index)) continue;
      if (reach.mayPass(boxOf(withHalo(extentOf(place))))) frames.add(frame.index);
    }
  }

  /// Those of the recording that is read.
  IndexRanges& framesOf(TileInWork& tile) const {
    tile.frames.resize(recording_count_);
    return tile.frames[plan_.recordings.size() - 1];
  }

  /// Calls visit(place) for the tiles that a block belongs to, halo included.
  template <class Visit>
  void visitTilesAround(const BlockKey& key, const Visit& visit) const {
    const int n = plan_.tile_blocks;
    const auto first = [n](int32_t x) { return floorDivided(x - kHaloBehind, n); };
    const auto last = [n](int32_t x) { return floorDivided(x + kHaloBefore, n); };
    for (int32_t z = first(key.z); z <= last(key.z); ++z) {
      for (int32_t y = first(key.y); y <= last(key.y); ++y) {
        for (int32_t x = first(key.x); x <= last(key.x); ++x) visit(Place{z, y, x});
      }
    }
  }

  BlockExtent extentOf(const Place& place) const {
    const int n = plan_.tile_blocks;
    const BlockKey first{place[2] * n, place[1] * n, place[0] * n};
    return {first, {first.x + n - 1, first.y + n - 1, first.z + n - 1}};
  }

  /// What feet of a tile's voxels may lie in: they are as far from them as the truncation.
  MetricBox boxOf(const BlockExtent& extent) const {
    const double margin_m =
        static_cast<double>(params_.map.voxel_size_m * (params_.map.truncation_voxels + 2.0f));
    const auto toVector = [](const BlockKey& key) { return Eigen::Vector3d(key.x, key.y, key.z); };
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(margin_m);
    return {toVector(extent.first) * blockSize_m() - margin,
            (toVector(extent.last) + Eigen::Vector3d::Ones()) * blockSize_m() + margin};
  }

  std::vector<Tile> makeTiles() const {
    std::vector<BlockRequest> blocks;
    blocks.reserve(blocks_.size());
    for (const auto& [key, directions] : blocks_) blocks.push_back({key, directions});
    std::sort(blocks.begin(), blocks.end(),
              [](const BlockRequest& a, const BlockRequest& b) { return a.key < b.key; });
    std::map<Place, std::vector<BlockRequest>> near;  // of each tile, halo included
    for (const BlockRequest& block : blocks) {
      visitTilesAround(unpackKey(block.key),
                       [&](const Place& place) { near[place].push_back(block); });
    }
    const double per_image_s = images_ > 0 ? image_seconds_ / static_cast<double>(images_) : 0.0;
    const size_t budget = static_cast<size_t>(params_.map.max_memory_mb) << 20;
    std::vector<Tile> tiles;
    for (const auto& [place, in_work] : tiles_) {
      Tile tile;
      tile.own = extentOf(place);
      tile.frames = in_work.frames;
      tile.frames.resize(recording_count_);
      tile.estimate.seconds = static_cast<double>(tile.frameCount()) * per_image_s +
                              static_cast<double>(in_work.touched_blocks) * kBlockSeconds;
      const std::vector<Tile> parts = cutToBudget(tile, near[place], budget);
      tiles.insert(tiles.end(), parts.begin(), parts.end());
    }
    return tiles;
  }

  const RunSettings settings_;
  const MapperParams params_;
  const Clock::time_point start_;
  size_t recording_count_;
  Plan plan_;
  std::unique_ptr<ProbedMapper> mapper_;
  std::unordered_map<PackedKey, uint32_t> blocks_;  ///< Directions of those that were touched.
  std::map<Place, TileInWork> tiles_;
  double image_seconds_ = 0.0;
  size_t images_ = 0;
};

/// Counts what a tile may hold, and whether anything of it is its own.
bool estimate(Tile& tile, const std::vector<BlockRequest>& blocks) {
  const BlockExtent wide = withHalo(tile.own);
  bool has_own = false;
  tile.estimate.blocks = tile.estimate.voxel_arrays = 0;
  for (const BlockRequest& block : blocks) {
    const BlockKey key = unpackKey(block.key);
    if (!wide.contains(key)) continue;
    has_own = has_own || tile.own.contains(key);
    ++tile.estimate.blocks;
    tile.estimate.voxel_arrays += static_cast<size_t>(__builtin_popcount(block.directions));
  }
  tile.estimate.map_bytes = tile.estimate.blocks * BlockTable::kBlockBytes +
                            tile.estimate.voxel_arrays * BlockTable::kArrayBytes;
  return has_own;
}

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

std::vector<Tile> cutToBudget(const Tile& tile, const std::vector<BlockRequest>& blocks,
                              size_t most_bytes) {
  Tile whole = tile;
  if (!estimate(whole, blocks)) return {};
  if (whole.estimate.map_bytes <= most_bytes) return {whole};
  if (isOneBlock(whole.own)) {
    throw std::runtime_error("a block and those around it take more than map/max_memory_mb; raise "
                             "it");
  }
  std::vector<Tile> parts;
  for (const BlockExtent& half : halvesOf(whole.own)) {
    Tile part = whole;
    part.own = half;
    const std::vector<Tile> cut = cutToBudget(part, blocks, most_bytes);
    parts.insert(parts.end(), cut.begin(), cut.end());
  }
  return parts;
}

Plan makePlan(const PlanRequest& request, const RunSettings& settings) {
  if (request.recordings.size() > 1 && !request.reading.recording.poses_path.empty()) {
    throw UsageError("--poses is for one recording, and there are several");
  }
  Planner planner(request, settings);
  for (const std::string& path : request.recordings) planner.read(path);
  return planner.finish();
}

}  // namespace dtsdf
