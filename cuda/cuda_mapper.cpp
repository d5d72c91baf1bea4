#include "cuda_mapper.h"

#include <chrono>
#include <functional>
#include <utility>

#include "backend/frame_check.h"
#include "cuda_map.h"
#include "runtime/device.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

double millisecondsSince(std::chrono::steady_clock::time_point start) {
  const auto end = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::milli>(end - start).count();
}

/// A map's space for those who ask, with all that frames saw: what the last one did may still be on
/// the device.
class FetchedSpace : public Space {
 public:
  using Fetch = std::function<void()>;

  FetchedSpace(const MapperParams& params, Fetch fetch)
      : map_(params, hostThreads(params)), fetch_(std::move(fetch)) {}

  /// Without what the last frame saw.
  SpaceMap& unfetched() { return map_; }

  double cellSize_m() const override { return map_.cellSize_m(); }
  Vec3i cellAt(const Eigen::Vector3d& p_W) const override { return map_.cellAt(p_W); }
  CellState stateOf(const Vec3i& cell) const override { return fetched().stateOf(cell); }
  std::vector<SpaceCell> cells() const override { return fetched().cells(); }
  std::vector<SpaceCube> cubes(int32_t first_z, int32_t last_z) const override {
    return fetched().cubes(first_z, last_z);
  }
  SpaceChanges takeChanges(bool all) override {
    fetch_();
    return map_.takeChanges(all);
  }
  void updateDistances() override { map_.updateDistances(); }
  int squaredDistance(const Vec3i& cell) const override { return map_.squaredDistance(cell); }
  SpaceDistance distanceAt(const Eigen::Vector3d& p_W) const override {
    return fetched().distanceAt(p_W);
  }
  size_t bytes() const override { return map_.bytes(); }

 private:
  static int hostThreads(const MapperParams& params) { return threadCount(params.threads); }

  const SpaceMap& fetched() const {
    fetch_();
    return map_;
  }

  SpaceMap map_;
  const Fetch fetch_;
};

class CudaMapper : public ProbedMapper {
 public:
  CudaMapper(const MapperParams& params, const Rules& rules)
      : params_(params),
        rules_(rules),
        device_(gpu::currentDevice()),
        name_(gpu::deviceName()) {
    if (params.space.enabled) {
      space_ = std::make_unique<FetchedSpace>(params, [this] { fetchSpace(); });
    }
    map();  // what the device lacks is to be told at start
  }

  IntegrationResult integrate(const DepthFrame& frame) override {
    const auto start = std::chrono::steady_clock::now();
    if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
    IntegrationResult result = withMemory([&] { return map().fuse(frame); }, refuseFrame);
    result.duration_ms = millisecondsSince(start);
    return result;
  }

  Alignment align(const DepthFrame& frame, const PosePrior& prior) override {
    Alignment unaligned;
    unaligned.T_W_C = frame.T_W_C;
    if (findProblem(frame, params_)) return unaligned;
    return withMemory([&] { return map().align(frame, prior); },
                      [&](const std::string&) { return unaligned; });
  }

  IntegrationResult paint(const ColourFrame& frame) override {
    const auto start = std::chrono::steady_clock::now();
    if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
    IntegrationResult result = withMemory([&] { return map().paint(frame); }, refuseFrame);
    result.duration_ms = millisecondsSince(start);
    return result;
  }

  void render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
              RenderedView& view) override {
    map().render(checkedFrameView(camera, T_W_C, params_), view);
  }

  void beginMeshUpdate() override { map().beginMeshUpdate(); }
  void waitForMeshes() override { map().waitForMeshes(); }
  MeshUpdate finishMeshUpdate() override { return map().finishMeshUpdate(); }

  ClearedRegion clearRegion(const Region& region) override { return map().clearRegion(region); }

  void clear() override {
    gpu::useDevice(device_);
    map_.reset();  // map() makes a new one, so that the device never holds two
    if (space_ != nullptr) space_->unfetched().clear();
  }

  Space* space() override { return space_.get(); }

  MapStats stats() const override { return map().stats(); }
  MapContents contents() override { return map().contents(); }

  void restore(const MapContents& contents) override {
    withMemory([&] { map().restore(contents); }, refuseMap);
  }

  void profileTo(Profile* profile) override {
    profile_ = profile;
    map().profileTo(profile);
  }
  std::vector<MemoryPart> memoryParts() const override { return map().memoryParts(); }

  void restrictTo(const MapExtent& extent) override {
    extent_ = extent;
    map().restrictTo(extent);
  }
  const std::vector<BlockRequest>& outsideExtent() const override {
    return map().outsideExtent();
  }
  void passOver(const PassedFrames& passed) override { map().passOver(passed); }

  std::string backendName() const override { return "cuda (" + name_ + ")"; }

 private:
  /// The map, on the calling thread's device from here on.
  gpu::CudaMap& map() const {
    gpu::useDevice(device_);
    if (map_ == nullptr) {
      map_ = std::make_unique<gpu::CudaMap>(
          params_, rules_, space_ == nullptr ? nullptr : &space_->unfetched());
      map_->profileTo(profile_);
      map_->restrictTo(extent_);
    }
    return *map_;
  }

  /// Asked for each cell that somebody looks at: costs nothing where nothing is on its way.
  void fetchSpace() const {
    if (map_ != nullptr && map_->hasUnfetchedSpace()) map().bringSpaceUpToDate();
  }

  /// Takes what comes; a lack of memory is told by `refuse`, given what CUDA says.
  template <class Take, class Refuse>
  static auto withMemory(const Take& take, const Refuse& refuse) -> decltype(take()) {
    try {
      return take();
    } catch (const gpu::CudaError& error) {
      if (error.code() != cudaErrorMemoryAllocation) throw;
      return refuse(std::string(error.what()));
    }
  }

  static IntegrationResult refuseFrame(const std::string& reason) {
    return refuse({FrameStatus::kNoMemory,
                   "the GPU has too little memory for this frame, which was not fused; lower "
                   "map/max_memory_mb or use larger voxels. " + reason});
  }

  static void refuseMap(const std::string& reason) {
    throw std::runtime_error("the GPU has too little memory for this map, which was not loaded; "
                             "clear_map frees that of the old one. " + reason);
  }

  MapperParams params_;
  Rules rules_;
  int device_;
  std::string name_;
  Profile* profile_ = nullptr;
  MapExtent extent_;
  std::unique_ptr<FetchedSpace> space_;  ///< Null where nobody asks for it. Outlives the map.
  mutable std::unique_ptr<gpu::CudaMap> map_;  ///< Null only after clear(), until it is used.
};

}  // namespace

std::string findCudaProblem() { return gpu::findDeviceProblem(gpu::anyKernel()); }

std::unique_ptr<ProbedMapper> makeCudaMapper(const MapperParams& params, const Rules& rules) {
  return std::make_unique<CudaMapper>(params, rules);
}

}  // namespace dtsdf
