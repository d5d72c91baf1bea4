#include "cuda_mapper.h"

#include <chrono>

#include "backend/frame_check.h"
#include "cuda_map.h"
#include "runtime/device.h"

namespace dtsdf {
namespace {

double millisecondsSince(std::chrono::steady_clock::time_point start) {
  const auto end = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::milli>(end - start).count();
}

class CudaMapper : public ProbedMapper {
 public:
  CudaMapper(const MapperParams& params, const Rules& rules)
      : params_(params),
        rules_(rules),
        device_(gpu::currentDevice()),
        name_(gpu::deviceName()) {
    map();  // what the device lacks is to be told at start
  }

  IntegrationResult integrate(const DepthFrame& frame) override {
    const auto start = std::chrono::steady_clock::now();
    if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
    IntegrationResult result = withMemory([&] { return map().fuse(frame); }, refuseFrame);
    result.duration_ms = millisecondsSince(start);
    return result;
  }

  IntegrationResult paint(const ColourFrame& frame) override {
    const auto start = std::chrono::steady_clock::now();
    if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
    IntegrationResult result = withMemory([&] { return map().paint(frame); }, refuseFrame);
    result.duration_ms = millisecondsSince(start);
    return result;
  }

  void beginMeshUpdate() override { map().beginMeshUpdate(); }
  void waitForMeshes() override { map().waitForMeshes(); }
  MeshUpdate finishMeshUpdate() override { return map().finishMeshUpdate(); }

  ClearedRegion clearRegion(const Region& region) override { return map().clearRegion(region); }

  void clear() override {
    gpu::useDevice(device_);
    map_.reset();  // map() makes a new one, so that the device never holds two
  }

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

  void restrictTo(const BlockExtent& extent) override {
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
      map_ = std::make_unique<gpu::CudaMap>(params_, rules_);
      map_->profileTo(profile_);
      map_->restrictTo(extent_);
    }
    return *map_;
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
  BlockExtent extent_;
  mutable std::unique_ptr<gpu::CudaMap> map_;  ///< Null only after clear(), until it is used.
};

}  // namespace

std::string findCudaProblem() { return gpu::findDeviceProblem(gpu::anyKernel()); }

std::unique_ptr<ProbedMapper> makeCudaMapper(const MapperParams& params, const Rules& rules) {
  return std::make_unique<CudaMapper>(params, rules);
}

}  // namespace dtsdf
