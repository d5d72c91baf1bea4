// The GPU gives the CPU's mesh on recorded frames, byte for byte. The folder of recordings is named
// by DTSDF_PARITY_FRAMES (see recorded_frames.h; pack_frames writes them), the voxel sizes in
// metres by DTSDF_PARITY_VOXELS, by default "0.02 0.01".
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <sstream>

#include "mapper/probed_mapper.h"
#include "parity/backend_comparison.h"
#include "parity/recorded_frames.h"

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
  std::vector<double> frame_ms, mesh_ms;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

template <class Work>
double timed(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

Reconstruction reconstruct(const std::vector<TestFrame>& frames, MapperParams params,
                           Backend backend) {
  params.backend = backend;
  Reconstruction run;
  run.mapper = makeProbedMapper(params);
  MeshStore store(params.map.voxel_size_m);
  double total_ms = 0.0;
  for (size_t i = 0; i < frames.size(); ++i) {
    run.frame_ms.push_back(timed(
        [&] { EXPECT_EQ(run.mapper->integrate(frames[i].view()).status, FrameStatus::kFused); }));
    total_ms += run.frame_ms.back();
    if ((i + 1) % kMeshEvery != 0 && i + 1 != frames.size()) continue;
    MeshUpdate update;
    run.mesh_ms.push_back(timed([&] { update = run.mapper->updateMesh(); }));
    total_ms += run.mesh_ms.back();
    store.apply(update);
  }
  run.mesh = store.assemble();
  std::cout << std::fixed << std::setprecision(2) << "  " << run.mapper->backendName() << ": frame "
            << median(run.frame_ms) << " ms, mesh update " << median(run.mesh_ms)
            << " ms (medians of " << run.frame_ms.size() << " and " << run.mesh_ms.size()
            << "), in all " << total_ms / static_cast<double>(frames.size()) << " ms a frame; "
            << run.mapper->stats().blocks << " blocks, " << run.mesh.triangles.size()
            << " triangles" << std::endl;
  return run;
}

TEST(RecordedParity, CudaEqualsCpu) {
  const std::vector<std::string> recordings = findRecordings();
  if (recordings.empty()) GTEST_SKIP() << "DTSDF_PARITY_FRAMES names no folder with recordings";
  const std::string reason = cudaUnavailableReason();
  if (!reason.empty()) GTEST_SKIP() << reason;
  for (const std::string& path : recordings) {
    const std::vector<TestFrame> frames = readRecordedFrames(path);
    for (const float voxel_size_m : voxelSizes()) {
      std::cout << std::filesystem::path(path).filename().string() << ", " << frames.size()
                << " frames, " << voxel_size_m << " m voxels" << std::endl;
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
