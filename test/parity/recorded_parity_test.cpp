// Checks that, on recorded frames, the GPU and the CPU give the same map and mesh, byte for byte.
// DTSDF_PARITY_FRAMES names the folder of recordings (written by pack_frames), DTSDF_PARITY_VOXELS
// the voxel sizes in metres, by default "0.02 0.01".
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "benchmark/raw_frames.h"
#include "mapper/probed_mapper.h"
#include "parity/backend_comparison.h"

namespace dtsdf {
namespace {

constexpr int kMeshEvery = 5;

std::vector<std::string> findRecordings() {
  std::vector<std::string> paths;
  const char* folder = std::getenv("DTSDF_PARITY_FRAMES");
  if (folder == nullptr) return paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".raw") continue;
    paths.push_back((entry.path().parent_path() / entry.path().stem()).string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::vector<float> voxelSizes() {
  const char* text = std::getenv("DTSDF_PARITY_VOXELS");
  std::istringstream list(text == nullptr ? "0.02 0.01" : text);
  std::vector<float> sizes;
  for (float size; list >> size;) sizes.push_back(size);
  return sizes;
}

struct Reconstruction {
  std::unique_ptr<ProbedMapper> mapper;
  Mesh mesh;
};

Reconstruction reconstruct(const std::vector<SourceFrame>& frames, MapperParams params,
                           Backend backend) {
  params.backend = backend;
  Reconstruction run{makeProbedMapper(params), {}};
  MeshStore store(params.map.voxel_size_m);
  for (size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(run.mapper->integrate(frames[i].depth).status, FrameStatus::kFused);
    if (i % kMeshEvery == 0 || i + 1 == frames.size()) store.apply(run.mapper->updateMesh());
  }
  run.mesh = store.assemble();
  return run;
}

std::vector<SourceFrame> readFrames(const std::string& path) {
  const auto source = openRawFrames(path, FrameSelection());
  std::vector<SourceFrame> frames;
  while (auto frame = source->next()) frames.push_back(std::move(*frame));
  return frames;
}

TEST(RecordedParity, CudaEqualsCpu) {
  const std::vector<std::string> recordings = findRecordings();
  if (recordings.empty()) GTEST_SKIP() << "DTSDF_PARITY_FRAMES is not a folder with recordings";
  const std::string reason = cudaUnavailableReason();
  if (!reason.empty()) GTEST_SKIP() << reason;
  for (const std::string& path : recordings) {
    const std::vector<SourceFrame> frames = readFrames(path);
    for (const float voxel_size_m : voxelSizes()) {
      SCOPED_TRACE(path + ", voxels of " + std::to_string(voxel_size_m) + " m");
      MapperParams params;
      params.map.voxel_size_m = voxel_size_m;
      const Reconstruction cuda = reconstruct(frames, params, Backend::kCuda);
      const Reconstruction cpu = reconstruct(frames, params, Backend::kCpu);
      ASSERT_EQ(cuda.mapper->backendName().rfind("cuda (", 0), 0u);
      EXPECT_GT(cpu.mesh.triangles.size(), 1000u);
      expectEqualMeshes(cpu.mesh, cuda.mesh);
      expectEqualMaps(*cpu.mapper, *cuda.mapper);
    }
  }
}

}  // namespace
}  // namespace dtsdf
