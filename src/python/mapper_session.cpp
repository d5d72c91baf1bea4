#include "python/mapper_session.h"

#include <unistd.h>

#include <stdexcept>

namespace dtsdf::python {
namespace {

bool isForked() {
  static const pid_t first = getpid();  // set by the first mapper; a fork inherits it
  return getpid() != first;
}

void refuseFork() {
  if (!isForked()) return;
  throw std::runtime_error(
      "a Mapper cannot be created or used in a process forked after dtsdf_mapping was used: "
      "start processes with multiprocessing.get_context(\"spawn\")");
}

}  // namespace

MapperSession::MapperSession(const MapperParams& params)
    : params_((refuseFork(), params)),
      mapper_(makeMapper(params)),
      meshes_(params.map.voxel_size_m) {}

MapperSession::MapperSession(const MapperParams& params, const MapContents& contents)
    : params_((refuseFork(), params)),
      mapper_(makeMapper(params, contents)),
      meshes_(params.map.voxel_size_m),
      origin_(contents) {}

MapperSession::~MapperSession() {
  // A forked child has neither the mapper's threads nor its GPU, so it cannot destroy the mapper.
  if (isForked()) static_cast<void>(mapper_.release());
}

std::unique_lock<std::mutex> MapperSession::enter() {
  refuseFork();  // before locking: the parent may have forked with the mutex locked
  return std::unique_lock<std::mutex>(mutex_);
}

IntegrationResult MapperSession::integrate(const DepthFrame& frame, double stamp_s) {
  const auto lock = enter();
  IntegrationResult result = mapper_->integrate(frame);
  if (result.status == FrameStatus::kFused && stamp_s != 0.0) origin_.stamp_s = stamp_s;
  return result;
}

std::shared_ptr<const Mesh> MapperSession::mesh(const std::optional<BoxRegion>& region) {
  const auto lock = enter();
  if (region) {
    const std::string problem = findProblem(*region);
    if (!problem.empty()) throw std::invalid_argument(problem);
  }
  updateMesh();
  return std::make_shared<const Mesh>(region ? meshes_.assemble(*region) : meshes_.assemble());
}

void MapperSession::clear() {
  const auto lock = enter();
  mapper_->clear();
  meshes_.clear();
  origin_.stamp_s = 0.0;
}

MapContents MapperSession::contents() {
  const auto lock = enter();
  MapContents contents = mapper_->contents();
  static_cast<MapOrigin&>(contents) = origin_;
  return contents;
}

MapInfo MapperSession::save(const std::string& path, const std::optional<std::string>& map_frame) {
  MapContents map = contents();
  if (map_frame) map.map_frame = *map_frame;
  return saveMap(map, path, params_.threads);
}

void MapperSession::updateSpace() {
  withSpace([this](Space& space) {
    updateMesh();
    space.updateDistances();
  });
}

void MapperSession::withSpace(const std::function<void(Space&)>& action) {
  const auto lock = enter();
  Space* const space = mapper_->space();
  if (space == nullptr) {
    throw std::runtime_error(
        "this mapper has no free-space grid: create it with **{\"space/enabled\": True}");
  }
  action(*space);
}

}  // namespace dtsdf::python
