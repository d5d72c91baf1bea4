#include "benchmark/measurement.h"

#include <stdexcept>

#include "dtsdf_mapping/mesh.h"
#include "mapper/probed_mapper.h"
#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "program/stopwatch.h"

namespace dtsdf {
namespace {

void integrateOrThrow(ProbedMapper& mapper, const DepthFrame& frame) {
  const IntegrationResult result = mapper.integrate(frame);
  if (result.status != FrameStatus::kFused) {
    throw std::runtime_error("a frame cannot be fused: " + result.message);
  }
  if (result.refused_blocks > 0) {
    throw std::runtime_error("the map is full; raise map/max_memory_mb");
  }
}

/// Packs a mesh in chunks as the node does by default.
class Packing {
 public:
  explicit Packing(const MeshStore& store) : store_(store) {}

  void noteChanges(const MeshUpdate& update) {
    for (const BlockMesh& block : update.blocks) chunks_.markChanged(block.key);
  }

  PackedSize packChanges() {
    const std::vector<PackedKey> changed(chunks_.changed().begin(), chunks_.changed().end());
    chunks_.forgetChanges();
    return pack(changed);
  }

  PackedSize packAll() const { return pack(chunks_.all()); }

 private:
  PackedSize pack(const std::vector<PackedKey>& keys) const {
    PackedSize size;
    for (const PackedChunk& chunk : packChunks(store_, lattice_, chunks_, keys, 0)) {
      size.bytes += bytesInMessage(chunk);
      size.triangles += chunk.triangleCount();
    }
    return size;
  }

  static constexpr int kChunkBlocks = 4;
  const MeshStore& store_;
  ChunkLattice lattice_{store_.voxelSize(), kChunkBlocks};
  MeshChunks chunks_{kChunkBlocks};
};

/// What a frame takes in all, and what the map takes in the end.
void measureTotals(const std::vector<SourceFrame>& frames, const MapperParams& params,
                   const Rules& rules, const std::function<void(size_t)>& show_progress,
                   Measurement& result) {
  const size_t taken = gpuMemoryTaken();
  const auto mapper = makeProbedMapper(params, rules);
  MeshStore store(params.map.voxel_size_m);
  Packing packing(store);
  for (const SourceFrame& frame : frames) {
    FrameTime time = timeFrame(*mapper, frame.depth, [&](const MeshUpdate& update) {
      store.apply(update);
      packing.noteChanges(update);
    });
    const Stopwatch watch;
    time.packed = packing.packChanges();
    time.pack_ms = watch.milliseconds();
    result.frames.push_back(time);
    show_progress(result.frames.size());
  }
  result.backend_name = mapper->backendName();
  result.map = mapper->stats();
  result.memory = mapper->memoryParts();
  result.device_bytes = gpuMemoryTakenSince(taken);
  result.triangles = store.triangleCount();
  result.packed = packing.packAll();
  for (const auto& [key, mesh] : store.blocks()) {
    result.mesh_bytes +=
        mesh->vertices.size() * sizeof(BlockVertex) + mesh->triangles.size() * sizeof(uint16_t);
  }
}

void measureStages(const std::vector<SourceFrame>& frames, const MapperParams& params,
                   const Rules& rules, const std::function<void(size_t)>& show_progress,
                   Measurement& result) {
  const auto mapper = makeProbedMapper(params, rules);
  Profile profile;
  mapper->profileTo(&profile);
  for (const SourceFrame& frame : frames) {
    profile = Profile();
    integrateOrThrow(*mapper, frame.depth);
    mapper->updateMesh();
    result.stages.push_back(profile);
    show_progress(frames.size() + result.stages.size());
  }
  mapper->profileTo(nullptr);
}

/// Each frame is aligned from the pose that it has.
void measureQueries(const std::vector<SourceFrame>& frames, const MapperParams& params,
                    const Rules& rules, Measurement& result) {
  const auto mapper = makeProbedMapper(params, rules);
  RenderedView view;
  for (const SourceFrame& frame : frames) {
    const DepthFrame& depth = frame.depth;
    QueryTime time;
    const Stopwatch watch;
    if (!result.queries.empty()) {
      mapper->align(depth, PosePrior());
      time.align_ms = watch.milliseconds();
    }
    integrateOrThrow(*mapper, depth);
    mapper->updateMesh();  // what was begun is done
    const Stopwatch rendering;
    mapper->render({depth.width, depth.height, depth.intrinsics}, depth.T_W_C, view);
    time.render_ms = rendering.milliseconds();
    result.queries.push_back(time);
  }
}

/// As a live map works: the meshes of a frame are fetched while the next frame is fused.
void measureOverlapped(const std::vector<SourceFrame>& frames, const MapperParams& params,
                       const Rules& rules, Measurement& result) {
  const auto mapper = makeProbedMapper(params, rules);
  const Stopwatch watch;
  for (const SourceFrame& frame : frames) {
    integrateOrThrow(*mapper, frame.depth);
    mapper->finishMeshUpdate();
    mapper->beginMeshUpdate();
  }
  mapper->finishMeshUpdate();
  result.overlapped_ms = watch.milliseconds() / static_cast<double>(frames.size());
}

}  // namespace

FrameTime timeFrame(ProbedMapper& mapper, const DepthFrame& frame,
                    const std::function<void(const MeshUpdate&)>& use) {
  FrameTime time;
  const double processor_start_s = processorSeconds();
  const Stopwatch watch;
  integrateOrThrow(mapper, frame);
  time.call_ms = watch.milliseconds();
  mapper.beginMeshUpdate();
  mapper.waitForMeshes();
  time.total_ms = watch.milliseconds();
  time.processor_ms = 1e3 * (processorSeconds() - processor_start_s);
  const MeshUpdate update = mapper.finishMeshUpdate();
  time.fetch_ms = watch.milliseconds() - time.total_ms;
  use(update);
  if (Space* const space = mapper.space()) {
    const Stopwatch updating;
    space->updateDistances();
    time.distances_ms = updating.milliseconds();
  }
  time.map_bytes = mapper.stats().map_bytes;
  return time;
}

Measurement measure(const std::vector<SourceFrame>& frames, const MapperParams& params,
                    const Rules& rules, const std::function<void(size_t)>& show_progress) {
  if (frames.empty()) throw std::runtime_error("no frame to measure");
  Measurement result;
  measureTotals(frames, params, rules, show_progress, result);
  measureStages(frames, params, rules, show_progress, result);
  measureQueries(frames, params, rules, result);
  if (result.backend_name.rfind("cuda", 0) == 0) {
    measureOverlapped(frames, params, rules, result);
  }
  return result;
}

}  // namespace dtsdf
