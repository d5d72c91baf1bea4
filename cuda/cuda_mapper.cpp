#include "cuda_mapper.h"

#include <chrono>

#include "cuda_map.h"
#include "mapper/frame_check.h"
#include "runtime/device.h"

namespace dtsdf {
namespace {

class CudaMapper : public Mapper {
 public:
  explicit CudaMapper(const MapperParams& params)
      : params_(params),
        device_(gpu::currentDevice()),
        name_(gpu::deviceName()),
        map_(std::make_unique<gpu::CudaMap>(params)) {}

  IntegrationResult integrate(const DepthFrame& frame) override {
    const auto start = std::chrono::steady_clock::now();
    IntegrationResult result;
    if (const auto problem = findProblem(frame, params_)) {
      result.status = problem->status;
      result.message = problem->message;
      return result;
    }
    gpu::useDevice(device_);
    result = integrateOnDevice(frame);
    result.duration_ms = std::chrono::duration<double, std::milli>(
                             std::chrono::steady_clock::now() - start).count();
    return result;
  }

  void beginMeshUpdate() override {
    gpu::useDevice(device_);
    map_->beginMeshUpdate();
  }

  MeshUpdate finishMeshUpdate() override {
    gpu::useDevice(device_);
    return map_->finishMeshUpdate();
  }

  void clear() override {
    gpu::useDevice(device_);
    map_.reset();  // first, so that the device never holds two maps
    map_ = std::make_unique<gpu::CudaMap>(params_);
  }

  MapStats stats() const override {
    gpu::useDevice(device_);
    return map_->stats();
  }

  std::vector<BlockSnapshot> snapshot() override {
    gpu::useDevice(device_);
    return map_->snapshot();
  }

  std::string backendName() const override { return "cuda (" + name_ + ")"; }

 private:
  IntegrationResult integrateOnDevice(const DepthFrame& frame) {
    try {
      return map_->integrate(frame);
    } catch (const gpu::CudaError& error) {
      if (error.code() != cudaErrorMemoryAllocation) throw;
      throw std::runtime_error(std::string("the GPU has too little memory for this frame, which was "
                                           "not fused; lower map/max_memory_mb or use larger "
                                           "voxels. ") + error.what());
    }
  }

  MapperParams params_;
  int device_;
  std::string name_;
  std::unique_ptr<gpu::CudaMap> map_;
};

}  // namespace

std::string findCudaProblem() { return gpu::findDeviceProblem(gpu::anyKernel()); }

std::unique_ptr<Mapper> makeCudaMapper(const MapperParams& params) {
  return std::make_unique<CudaMapper>(params);
}

}  // namespace dtsdf
