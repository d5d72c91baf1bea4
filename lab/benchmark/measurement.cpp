#include "benchmark/measurement.h"

#include <stdexcept>

#include "dtsdf_mapping/mesh.h"
#include "mapper/probed_mapper.h"
#include "program/stopwatch.h"

namespace dtsdf {
namespace {

void integrateOrThrow(ProbedMapper& mapper, const DepthFrame& frame) {
  const IntegrationResult result = mapper.integrate(frame);
  if (result.status != FrameStatus::kFused) {
    throw std::runtime_error("a frame could not be fused: " + result.message);
  }
  if (result.refused_blocks > 0) {
    throw std::runtime_error("the map is full; raise map/max_memory_mb");
  }
}

/// Measures the total time per frame, and the memory in use at the end.
void measureTotals(const std::vector<SourceFrame>& frames, const MapperParams& params,
                   const Rules& rules, const std::function<void(size_t)>& show_progress,
                   Measurement& result) {
  const size_t taken = gpuMemoryTaken();
  const auto mapper = makeProbedMapper(params, rules);
  MeshStore store(params.map.voxel_size_m);
  for (const SourceFrame& frame : frames) {
    result.frames.push_back(
        timeFrame(*mapper, frame.depth, [&](const MeshUpdate& update) { store.apply(update); }));
    show_progress(result.frames.size());
  }
  result.backend_name = mapper->backendName();
  result.map = mapper->stats();
  result.memory = mapper->memory();
  result.device_bytes = gpuMemoryTakenSince(taken);
  result.triangles = store.triangleCount();
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

/// On a GPU, integrate() waits for the previous frame to be done, but not for its own frame, so a
/// call takes about as long as a frame.
void measureFusion(const std::vector<SourceFrame>& frames, const MapperParams& params,
                   const Rules& rules, const std::function<void(size_t)>& show_progress,
                   Measurement& result) {
  const auto mapper = makeProbedMapper(params, rules);
  for (const SourceFrame& frame : frames) {
    const auto begin = std::chrono::steady_clock::now();
    integrateOrThrow(*mapper, frame.depth);
    result.fusion_ms.push_back(millisecondsSince(begin));
    show_progress(frames.size() + result.fusion_ms.size());
  }
}

}  // namespace

FrameTime timeFrame(ProbedMapper& mapper, const DepthFrame& frame,
                    const std::function<void(const MeshUpdate&)>& use) {
  FrameTime time;
  const double processor_start_s = processorSeconds();
  const auto begin = std::chrono::steady_clock::now();
  integrateOrThrow(mapper, frame);
  time.call_ms = millisecondsSince(begin);
  mapper.beginMeshUpdate();
  mapper.waitForMeshes();
  time.total_ms = millisecondsSince(begin);
  time.processor_ms = 1e3 * (processorSeconds() - processor_start_s);
  const MeshUpdate update = mapper.finishMeshUpdate();
  time.fetch_ms = millisecondsSince(begin) - time.total_ms;
  use(update);
  if (Space* const space = mapper.space()) {
    const auto meshed = std::chrono::steady_clock::now();
    space->updateDistances();
    time.distances_ms = millisecondsSince(meshed);
  }
  time.map_bytes = mapper.stats().map_bytes;
  return time;
}

Measurement measure(const std::vector<SourceFrame>& frames, const MapperParams& params,
                    const Rules& rules, const std::function<void(size_t)>& show_progress) {
  if (frames.empty()) throw std::runtime_error("there are no frames to measure");
  Measurement result;
  measureTotals(frames, params, rules, show_progress, result);
  const auto measure_rest = result.memory.on_gpu ? measureFusion : measureStages;
  measure_rest(frames, params, rules, show_progress, result);
  return result;
}

}  // namespace dtsdf
