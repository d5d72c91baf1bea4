#include <stdexcept>
#include <utility>

#include "backend/rule_settings.h"
#include "cpu/cpu_backend.h"
#include "engine/engine.h"
#include "mapper/probed_mapper.h"
#ifdef DTSDF_WITH_CUDA
#include "cuda_backend.h"
#endif

namespace dtsdf {

#ifdef DTSDF_WITH_CUDA
std::string cudaUnavailableReason() { return findCudaProblem(); }
#else
std::string cudaUnavailableReason() {
  return "this build has no CUDA backend; build with -DWITH_CUDA=ON and the CUDA Toolkit installed";
}
static BackendMaker cudaBackends(const MapperParams&, const Rules&) { return nullptr; }
static size_t cudaMemoryTaken() { return 0; }
#endif

size_t gpuMemoryTaken() { return cudaUnavailableReason().empty() ? cudaMemoryTaken() : 0; }

size_t gpuMemoryTakenSince(size_t before) {
  const size_t now = gpuMemoryTaken();
  return now > before ? now - before : 0;
}

MeshUpdate Mapper::updateMesh() {
  beginMeshUpdate();
  MeshUpdate made = finishMeshUpdate();
  while (made.is_part) {
    beginMeshUpdate();
    MeshUpdate next = finishMeshUpdate();
    made.is_part = next.is_part;
    addMeshes(std::move(next), made);
  }
  return made;
}

static BackendMaker backendsFor(const MapperParams& params, const Rules& rules) {
  if (params.backend == Backend::kCpu) return cpuBackends(params, rules);
  const std::string reason = cudaUnavailableReason();
  if (reason.empty()) return cudaBackends(params, rules);
  if (params.backend == Backend::kAuto) return cpuBackends(params, rules);
  throw std::runtime_error("backend 'cuda' cannot be used: " + reason);
}

std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules) {
  const Rules used = withMemory(rules, params);
  return std::make_unique<Engine>(params, used, cpuThreads(params), backendsFor(params, used));
}

std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapContents& contents) {
  checkContents(contents);
  const std::shared_ptr<const MapContents> head(std::shared_ptr<void>(), &contents);
  return makeProbedMapper(params, rules, MapParts{head, [&](const auto& take) { take(contents); }});
}

std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapParts& parts) {
  checkHead(*parts.head);
  checkFits(*parts.head, params);
  std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(params, rules);
  mapper->restore(parts);
  return mapper;
}

std::unique_ptr<Mapper> makeMapper(const MapperParams& params) { return makeProbedMapper(params); }

std::unique_ptr<Mapper> makeMapper(const MapperParams& params, const MapContents& contents) {
  return makeProbedMapper(params, Rules(), contents);
}

std::unique_ptr<Mapper> makeMapper(const MapperParams& params, const MapParts& parts) {
  return makeProbedMapper(params, Rules(), parts);
}

}  // namespace dtsdf
