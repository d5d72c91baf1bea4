#include "tiles/fuse_tile.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/prefetched_frames.h"
#include "io/atomic_file.h"
#include "io/block_mesh_file.h"
#include "io/map_chunks.h"
#include "map/map_head.h"
#include "mapper/probed_mapper.h"
#include "program/progress_bar.h"
#include "tiles/process_usage.h"
#include "tiles/tile_folder.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

constexpr size_t kFramesAhead = 4;

/// The frames of a plan that a tile fuses, and the numbers of all.
class TileFusion {
 public:
  TileFusion(const LoadedPlan& loaded, size_t tile, const RunSettings& settings)
      : plan_(loaded.plan),
        tile_(loaded.plan.tiles[tile]),
        settings_(settings),
        mapper_(makeProbedMapper(settings.params.mapper, settings.rules)),
        progress_("frames", tile_.frameCount()) {
    mapper_->restrictTo(withHalo(tile_.own));
    for (size_t i = 0; i < plan_.recordings.size(); ++i) fuseRecording(i);
  }

  ProbedMapper& mapper() { return *mapper_; }

 private:
  void fuseRecording(size_t number) {
    const PlannedRecording& recording = plan_.recordings[number];
    const IndexRanges& wanted = tile_.frames[number];
    const std::unique_ptr<FrameSource> source =
        wanted.empty() ? nullptr : openListed(number, wanted);
    PassedFrames passed;
    for (const size_t index : recording.fused.list()) {
      if (!wanted.contains(index)) {
        ++passed.frames;
        passed.supporting_frames += recording.supporting.contains(index);
        continue;
      }
      mapper_->passOver(passed);
      passed = PassedFrames();
      fuseFrame(*source, recording, index);
    }
    mapper_->passOver(passed);
  }

  std::unique_ptr<FrameSource> openListed(size_t number, const IndexRanges& wanted) const {
    InputOptions input = plan_.inputOf(number);
    input.recording.selection.listed = std::make_shared<const std::vector<size_t>>(wanted.list());
    return prefetchFrames(openFrames(input, settings_.params.node), kFramesAhead);
  }

  void fuseFrame(FrameSource& source, const PlannedRecording& recording, size_t index) {
    const std::optional<SourceFrame> frame = source.next();
    if (!frame || frame->index != index) throwChanged(recording, index, "it is not there any more");
    const IntegrationResult result = mapper_->integrate(frame->depth);
    if (result.status == FrameStatus::kNoMemory) throw std::runtime_error(result.message);
    if (result.status != FrameStatus::kFused) throwChanged(recording, index, result.message);
    if (result.refused_blocks > 0) throwFull();
    progress_.show(++done_);
  }

  [[noreturn]] static void throwChanged(const PlannedRecording& recording, size_t index,
                                        const std::string& how) {
    throw std::runtime_error("image " + std::to_string(index) + " of '" + recording.path +
                             "' is not the one that was planned with (" + how +
                             "); make the plan anew");
  }

  [[noreturn]] void throwFull() const {
    throw std::runtime_error(
        "the tile takes more than its budget, map/max_memory_mb: " +
        std::to_string(settings_.params.mapper.map.max_memory_mb) +
        "; make the plan anew with a smaller --tile-m, or raise it there");
  }

  const Plan& plan_;
  const Tile& tile_;
  const RunSettings& settings_;
  const std::unique_ptr<ProbedMapper> mapper_;
  ProgressBar progress_;
  size_t done_ = 0;
};

/// The part of a map that lies in an extent, as it is saved.
class OwnPart {
 public:
  OwnPart(const MapContents& whole, const BlockExtent& own)
      : whole_(whole), head_(headOf(whole)) {
    size_t word = 0;
    for (const MapBlock& block : whole.blocks) {
      const size_t words = wordsOf(block);
      if (own.contains(block.key)) {
        head_.blocks.push_back(block);
        first_word_.push_back(word);
      }
      word += words;
    }
  }

  SavedMap save(const std::string& path) {
    return saveMapInChunks(head_, {[this](size_t chunk) { return gather(chunk); }, nullptr}, path,
                           1);
  }

 private:
  static size_t wordsOf(const MapBlock& block) {
    return static_cast<size_t>(__builtin_popcount(block.directions)) * kVoxelsPerBlock;
  }

  const uint64_t* gather(size_t chunk) {
    const size_t end = std::min(head_.blocks.size(), (chunk + 1) * kBlocksPerMapChunk);
    words_.clear();
    for (size_t i = chunk * kBlocksPerMapChunk; i < end; ++i) {
      const uint64_t* const words = whole_.voxels.data() + first_word_[i];
      words_.insert(words_.end(), words, words + wordsOf(head_.blocks[i]));
    }
    return words_.data();
  }

  const MapContents& whole_;
  MapContents head_;
  std::vector<size_t> first_word_;  ///< Of a block's voxels in the whole.
  std::vector<uint64_t> words_;
};

void saveMeshes(ProbedMapper& mapper, const BlockExtent& own, const std::string& path,
                TileRecord& record) {
  const MeshUpdate update = mapper.updateMesh();
  std::vector<const BlockMesh*> meshes;
  for (const BlockMesh& mesh : update.blocks) {
    if (mesh.triangles.empty() || !own.contains(mesh.key)) continue;
    meshes.push_back(&mesh);
    record.mesh_bounds.add(mesh.key);
    record.triangles += mesh.triangles.size() / 3;
  }
  record.mesh_checksum = saveBlockMeshes(meshes, path);
  record.mesh_file_bytes = std::filesystem::file_size(path);
}

void saveMap(ProbedMapper& mapper, const LoadedPlan& loaded, const BlockExtent& own,
             const std::string& path, TileRecord& record) {
  MapContents contents = mapper.contents();
  contents.map_frame = loaded.plan.map_frame;
  contents.stamp_s = loaded.plan.stamp_s;
  const SavedMap saved = OwnPart(contents, own).save(path);
  record.content_hash = saved.content_hash;
  record.map_file_bytes = saved.file_bytes;
  record.blocks = saved.size.blocks;
  record.voxel_arrays = saved.size.voxel_arrays;
}

TileRecord makeTile(const FuseRequest& request, const LoadedPlan& loaded) {
  const auto start = std::chrono::steady_clock::now();
  const Tile& tile = loaded.plan.tiles[request.tile];
  const RunSettings settings = settingsOf(loaded.plan, request.backend, request.threads);
  TileFusion fusion(loaded, request.tile, settings);
  TileRecord record;
  record.plan_id = loaded.id;
  record.frames = tile.frameCount();
  record.backend = fusion.mapper().backendName();
  record.map_bytes = fusion.mapper().stats().map_bytes;
  saveMeshes(fusion.mapper(), tile.own, tilePath(request.folder, request.tile, ".mesh"), record);
  saveMap(fusion.mapper(), loaded, tile.own, tilePath(request.folder, request.tile, ".dtsdf"),
          record);
  record.peak_bytes = peakBytes();
  record.processor_s = processorSeconds();
  record.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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

RunSettings settingsOf(const Plan& plan, const std::optional<std::string>& backend,
                       const std::optional<int>& threads) {
  ParamTree tree = plan.settings;
  if (backend) tree["backend"] = *backend;
  if (threads) tree["threads"] = *threads;
  return readSettings(std::move(tree));
}

void fuseTile(const FuseRequest& request, const LoadedPlan& loaded) {
  const TileLock lock(request.folder, request.tile);
  const std::string name = "tile " + std::to_string(request.tile);
  const bool is_done = missingOfTile(request.folder, request.tile, loaded.id).empty();
  if (is_done && !request.again) {
    std::printf("%s is done already\n", name.c_str());
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
    noteFailure(request, error.what());
    throw std::runtime_error(name + ": " + error.what());
  }
}

}  // namespace dtsdf
