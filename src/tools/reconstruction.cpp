#include "tools/reconstruction.h"

#include <chrono>
#include <stdexcept>

namespace dtsdf {
namespace {

/// Runs `action` and returns its wall time.
template <class Action>
double timeMs(const Action& action) {
  const auto start = std::chrono::steady_clock::now();
  action();
  const auto end = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::milli>(end - start).count();
}

size_t sumOf(const std::map<std::string, size_t>& counts) {
  size_t sum = 0;
  for (const auto& [reason, count] : counts) sum += count;
  return sum;
}

/// The state of one run.
class Reconstruction {
 public:
  Reconstruction(Mapper& mapper, float voxel_size_m) : mapper_(mapper), store_(voxel_size_m) {}

  void fuse(const DepthFrame& frame) {
    IntegrationResult integration;
    result_.integrate_ms.push_back(timeMs([&] { integration = mapper_.integrate(frame); }));
    if (integration.status == FrameStatus::kFused) {
      ++result_.frames;
    } else {
      ++result_.skipped[toString(integration.status)];
    }
    ++frames_since_mesh_;
  }

  void updateMeshIfDue(size_t mesh_every) {
    if (frames_since_mesh_ < mesh_every) return;
    result_.mesh_ms.push_back(timeMs([&] { store_.apply(mapper_.updateMesh()); }));
    frames_since_mesh_ = 0;
  }

  size_t framesNotFused() const { return sumOf(result_.skipped); }

  ReconstructionResult finish(const std::map<std::string, size_t>& skipped_by_source) {
    for (const auto& [reason, count] : skipped_by_source) result_.skipped[reason] += count;
    if (result_.frames == 0) {
      const std::string reasons = describeSkipped(result_.skipped);
      throw std::runtime_error("no frame was fused (" +
                               (reasons.empty() ? "none was selected" : reasons) +
                               "), so there is no mesh to save");
    }
    updateMeshIfDue(1);
    result_.map = mapper_.stats();
    result_.mesh = store_.assemble();
    return std::move(result_);
  }

  size_t frames() const { return result_.frames; }

 private:
  Mapper& mapper_;
  MeshStore store_;
  ReconstructionResult result_;
  size_t frames_since_mesh_ = 0;
};

}  // namespace

std::string describeSkipped(const std::map<std::string, size_t>& skipped) {
  std::string text;
  for (const auto& [reason, count] : skipped) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  }
  return text;
}

ReconstructionResult reconstruct(FrameSource& source, Mapper& mapper, float voxel_size_m,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress) {
  Reconstruction reconstruction(mapper, voxel_size_m);
  while (const std::optional<SourceFrame> frame = source.next()) {
    reconstruction.fuse(frame->depth);
    if (mesh_every > 0) reconstruction.updateMeshIfDue(mesh_every);
    show_progress(reconstruction.frames() + reconstruction.framesNotFused() +
                  sumOf(source.skipped()));
  }
  return reconstruction.finish(source.skipped());
}

}  // namespace dtsdf
