#include "tiles/fuse_tile.h"

#include <sys/resource.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/prefetched_frames.h"
#include "io/atomic_file.h"
#include "io/block_mesh_file.h"
#include "io/map_chunks.h"
#include "mapper/probed_mapper.h"
#include "page/paged_meshes.h"
#include "params/printable.h"
#include "program/progress_bar.h"
#include "program/stopwatch.h"
#include "tiles/tile_folder.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

/// The frames of a plan that a tile fuses, and the numbers of all.
class TileFusion {
 public:
  TileFusion(const LoadedPlan& loaded, size_t tile, const RunSettings& settings)
      : plan_(loaded.plan),
        tile_(loaded.plan.tiles[tile]),
        settings_(settings),
        mapper_(makeProbedMapper(settings.params.mapper, settings.rules)),
        progress_("frames", tile_.frameCount()) {
    const int cell_voxels = settings.params.mapper.space.cell_voxels;
    mapper_->restrictTo({tile_.fused, withHalo(tile_.own), cubesOf(tile_.own, cell_voxels)});
    for (size_t i = 0; i < plan_.recordings.size(); ++i) fuseRecording(i);
    if (mapper_->stats().refused_cubes > 0) throwFull();
  }

  ProbedMapper& mapper() { return *mapper_; }

 private:
  void fuseRecording(size_t number) {
    const PlannedRecording& recording = plan_.recordings[number];
    const IndexRanges& wanted = tile_.frames[number];
    const std::unique_ptr<FrameSource> source =
        wanted.empty() ? nullptr : openListed(number, wanted);
    ImageQueue images(*this, number);
    PassedFrames passed;
    size_t frames = 0;
    for (const size_t index : recording.fused.list()) {
      if (images.isNextAfter(frames)) {
        passOver(passed);
        images.paintAfter(frames);
      }
      ++frames;
      if (!wanted.contains(index)) {
        ++passed.frames;
        passed.supporting_frames += recording.supporting.contains(index);
        continue;
      }
      passOver(passed);
      fuseFrame(*source, recording, index);
    }
    passOver(passed);
    images.paintAfter(frames);
  }

  /// The colour images that a tile takes of a recording, in their order.
  class ImageQueue {
   public:
    ImageQueue(TileFusion& fusion, size_t number)
        : fusion_(fusion), recording_(fusion.plan_.recordings[number]) {
      const IndexRanges& wanted = fusion.tile_.images[number];
      for (const PlannedImage& image : recording_.images) {
        if (wanted.contains(image.index)) images_.push_back(image);
      }
      if (!images_.empty()) source_ = fusion.openListedColours(number, wanted);
    }

    /// Whether one is to be painted when so many of the recording's frames are fused.
    bool isNextAfter(size_t frames) const {
      return next_ < images_.size() && images_[next_].frames_before == frames;
    }

    void paintAfter(size_t frames) {
      for (; isNextAfter(frames); ++next_) {
        const size_t index = images_[next_].index;
        const std::optional<SourceColour> image =
            source_ == nullptr ? std::nullopt : source_->next();
        if (!image || image->index != index) {
          throwChanged("colour image", recording_, index, "it no longer exists");
        }
        fusion_.paint(image->colour, recording_, index);
      }
    }

   private:
    TileFusion& fusion_;
    const PlannedRecording& recording_;
    std::vector<PlannedImage> images_;
    std::unique_ptr<ColourSource> source_;
    size_t next_ = 0;
  };

  void passOver(PassedFrames& passed) {
    mapper_->passOver(passed);
    passed = PassedFrames();
  }

  void paint(const ColourFrame& image, const PlannedRecording& recording, size_t index) {
    const IntegrationResult result = mapper_->paint(image);
    if (result.status == FrameStatus::kNoMemory) throw std::runtime_error(result.message);
    // kNoMeasurement is no change: the plan errs on the side of more, so an image may show nothing
    // of this tile.
    if (result.status != FrameStatus::kFused && result.status != FrameStatus::kNoMeasurement) {
      throwChanged("colour image", recording, index, result.message);
    }
    if (result.refused_blocks > 0) throwFull();
  }

  static std::shared_ptr<const std::vector<size_t>> listOf(const IndexRanges& wanted) {
    return std::make_shared<const std::vector<size_t>>(wanted.list());
  }

  std::unique_ptr<FrameSource> openListed(size_t number, const IndexRanges& wanted) const {
    InputOptions input = plan_.inputOf(number);
    input.recording.selection.listed = listOf(wanted);
    return prefetchFrames(levelled(openFrames(input, settings_.params.node), plan_.T_W_M));
  }

  std::unique_ptr<ColourSource> openListedColours(size_t number, const IndexRanges& wanted) const {
    InputOptions input = plan_.inputOf(number);
    input.recording.listed_colours = listOf(wanted);
    return levelled(openColours(input, settings_.params.node), plan_.T_W_M);
  }

  void fuseFrame(FrameSource& source, const PlannedRecording& recording, size_t index) {
    const std::optional<SourceFrame> frame = source.next();
    if (!frame || frame->index != index) {
      throwChanged("image", recording, index, "it no longer exists");
    }
    const IntegrationResult result = mapper_->integrate(frame->depth);
    if (result.status == FrameStatus::kNoMemory) throw std::runtime_error(result.message);
    if (result.status != FrameStatus::kFused) {
      throwChanged("image", recording, index, result.message);
    }
    if (result.refused_blocks > 0) throwFull();
    progress_.show(++done_);
  }

  [[noreturn]] static void throwChanged(const std::string& kind, const PlannedRecording& recording,
                                        size_t index, const std::string& how) {
    throw std::runtime_error(kind + " " + std::to_string(index) + " of '" + recording.path +
                             "' has changed since the plan was made (" + how +
                             "); make the plan again");
  }

  [[noreturn]] void throwFull() const {
    const std::string problem = mapper_->stats().pages.problem;
    throw std::runtime_error(
        "the tile takes more than its budget, map/max_memory_mb: " +
        std::to_string(settings_.params.mapper.map.max_memory_mb) +
        "; make the plan again with a smaller --tile-m, or with a larger map/max_memory_mb" +
        (problem.empty() ? "" : " (map/page_folder: " + problem + ")"));
  }

  const Plan& plan_;
  const Tile& tile_;
  const RunSettings& settings_;
  const std::unique_ptr<ProbedMapper> mapper_;
  ProgressBar progress_;
  size_t done_ = 0;
};

/// One by one: with map/page_folder they lie on disk as the map does.
void saveMeshes(ProbedMapper& mapper, const MapParams& params, const BlockExtent& own,
                const std::string& path, TileRecord& record) {
  PagedMeshes meshes(params);
  for (bool is_part = true; is_part;) {
    mapper.beginMeshUpdate();
    MeshUpdate update = mapper.finishMeshUpdate();
    is_part = update.is_part;
    for (BlockMesh& mesh : update.blocks) {
      if (own.contains(mesh.key)) meshes.put(std::make_shared<BlockMesh>(std::move(mesh)));
    }
  }
  const std::vector<PackedKey> keys = meshes.keys();
  for (const PackedKey key : keys) record.mesh_bounds.add(unpackKey(key));
  record.triangles = meshes.triangleCount();
  const auto visit = [&](const std::function<void(const BlockMesh&)>& take) {
    for (const PackedKey key : keys) {
      const SharedBlockMesh mesh = meshes.find(key);
      if (mesh == nullptr) throw std::runtime_error(meshes.stats().problem);
      take(*mesh);
    }
  };
  record.mesh_checksum = saveBlockMeshes(visit, path);
  record.mesh_file_bytes = std::filesystem::file_size(path);
}

void saveMap(ProbedMapper& mapper, const LoadedPlan& loaded, const BlockExtent& own,
             const std::string& path, TileRecord& record) {
  const SavedMap saved = savePartOf(
      mapper, loaded.plan, [&](const BlockKey& key) { return own.contains(key); }, path);
  const PageStats pages = mapper.stats().pages;
  if (pages.lost > 0) throw std::runtime_error(pages.problem);
  record.content_hash = saved.content_hash;
  record.map_file_bytes = saved.file_bytes;
  record.blocks = saved.size.blocks;
  record.voxel_arrays = saved.size.voxel_arrays;
  record.free_cubes = saved.size.free_cubes;
}

/// The most memory that this process has had at once, in bytes.
size_t peakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<size_t>(usage.ru_maxrss) * 1024;
}

TileRecord makeTile(const FuseRequest& request, const LoadedPlan& loaded) {
  const Stopwatch watch;
  const Tile& tile = loaded.plan.tiles[request.tile];
  const RunSettings settings = settingsOf(loaded.plan, request.options);
  TileFusion fusion(loaded, request.tile, settings);
  TileRecord record;
  record.plan_id = loaded.id;
  record.frames = tile.frameCount();
  record.images = tile.imageCount();
  record.backend = fusion.mapper().backendName();
  record.map_bytes = fusion.mapper().stats().map_bytes;
  saveMeshes(fusion.mapper(), settings.params.mapper.map, tile.own,
             tilePath(request.folder, request.tile, ".mesh"), record);
  saveMap(fusion.mapper(), loaded, tile.own, tilePath(request.folder, request.tile, ".dtsdf"),
          record);
  record.peak_bytes = peakBytes();
  record.processor_s = processorSeconds();
  record.seconds = watch.seconds();
  return record;
}

/// Noted as well as it can be: it may be the disk that is full.
void noteFailure(const FuseRequest& request, const std::string& why) {
  try {
    writeFileAtomically(tilePath(request.folder, request.tile, ".failed"), why);
  } catch (const std::exception&) {
  }
}

}  // namespace

RunSettings settingsOf(const Plan& plan, const FuseOptions& options) {
  ParamTree tree = plan.settings;
  if (options.backend) tree["backend"] = *options.backend;
  if (options.threads) tree["threads"] = *options.threads;
  return readSettings(std::move(tree));
}

void fuseTile(const FuseRequest& request, const LoadedPlan& loaded) {
  const TileLock lock(request.folder, request.tile);
  const std::string name = "tile " + std::to_string(request.tile);
  const bool is_done = missingOfTile(request.folder, request.tile, loaded.id).empty();
  if (is_done && !request.again) {
    std::printf("%s is already done\n", name.c_str());
    return;
  }
  forgetTile(request.folder, request.tile);
  try {
    const TileRecord record = makeTile(request, loaded);
    saveRecord(record, request.folder, request.tile);
    std::printf("%s: %zu frames on %s in %.1f s, %zu blocks, %zu triangles\n", name.c_str(),
                record.frames, record.backend.c_str(), record.seconds, record.blocks,
                record.triangles);
  } catch (const std::exception& error) {
    noteFailure(request, errorText(error));
    throw std::runtime_error(name + ": " + error.what());
  }
}

}  // namespace dtsdf
