#include "parity/backend_comparison.h"

#include <algorithm>
#include <cstring>
#include <sstream>

#include "support/block_snapshot.h"
#include "support/same_bytes.h"

namespace dtsdf {
namespace {

MapperParams paramsOf(const MapperParams& params, Candidate candidate) {
  MapperParams result = params;
  result.backend = candidate == Candidate::kCuda ? Backend::kCuda : Backend::kCpu;
  result.threads = candidate == Candidate::kCpuTwoThreads ? 2 : 1;
  return result;
}

std::string nameStart(Candidate candidate) {
  switch (candidate) {
    case Candidate::kReference: return "cpu (1 thread)";
    case Candidate::kCpuTwoThreads: return "cpu (2 threads)";
    case Candidate::kCuda: return "cuda (";
  }
  return "";
}

std::string describe(const BlockKey& key) {
  std::ostringstream text;
  text << "block (" << key.x << ", " << key.y << ", " << key.z << ")";
  return text.str();
}

/// The first differing voxel, for the failure message.
std::string firstDifference(const std::vector<Voxel>& a, const std::vector<Voxel>& b) {
  std::ostringstream text;
  text.precision(9);
  if (a.size() != b.size()) {
    text << a.size() << " voxels expected, found " << b.size();
    return text.str();
  }
  for (size_t i = 0; i < a.size(); ++i) {
    if (std::memcmp(&a[i], &b[i], sizeof(Voxel)) == 0) continue;
    const auto write = [&](const Voxel& voxel) {
      text << "(" << sdfOf(voxel) << ", weight " << weightOf(voxel) << ", evidence "
           << evidenceOf(voxel) << ")";
    };
    text << "voxel " << i << ": ";
    write(a[i]);
    text << " expected, found ";
    write(b[i]);
    break;
  }
  return text.str();
}

bool sameBlockMesh(const BlockMesh& a, const BlockMesh& b) {
  return a.key == b.key && sameBytes(a.vertices, b.vertices) &&
         sameBytes(a.triangles, b.triangles) && sameBytes(a.colours, b.colours);
}

void expectEqualResults(const IntegrationResult& expected, const IntegrationResult& actual) {
  ASSERT_EQ(actual.status, expected.status) << actual.message << " / " << expected.message;
  ASSERT_EQ(actual.message, expected.message);
  ASSERT_EQ(actual.refused_blocks, expected.refused_blocks);
}

}  // namespace

std::string toString(Candidate candidate) {
  switch (candidate) {
    case Candidate::kReference: return "Reference";
    case Candidate::kCpuTwoThreads: return "CpuTwoThreads";
    case Candidate::kCuda: return "Cuda";
  }
  return "";
}

std::string reasonToSkip(Candidate candidate) {
  return candidate == Candidate::kCuda ? cudaUnavailableReason() : "";
}

BackendPair::BackendPair(const MapperParams& params, Candidate candidate, const Rules& rules)
    : reference_params_(paramsOf(params, Candidate::kReference)),
      candidate_params_(paramsOf(params, candidate)),
      rules_(rules),
      reference_(makeProbedMapper(reference_params_, rules)),
      candidate_(makeProbedMapper(candidate_params_, rules)),
      reference_mesh_(params.map.voxel_size_m),
      candidate_mesh_(params.map.voxel_size_m) {
  EXPECT_EQ(reference_->backendName(), "cpu (1 thread)");
  EXPECT_EQ(candidate_->backendName().rfind(nameStart(candidate), 0), 0u)
      << candidate_->backendName();
}

void BackendPair::integrateUnchecked(const DepthFrame& frame) {
  const IntegrationResult expected = reference_->integrate(frame);
  expectEqualResults(expected, candidate_->integrate(frame));
}

void BackendPair::paint(const ColourFrame& frame) {
  const IntegrationResult expected = reference_->paint(frame);
  ASSERT_NO_FATAL_FAILURE(expectEqualResults(expected, candidate_->paint(frame)));
  compareStats();
}

void BackendPair::integrate(const DepthFrame& frame) {
  ASSERT_NO_FATAL_FAILURE(integrateUnchecked(frame));
  compareStats();
}

void BackendPair::compareStats() {
  reference_->outline();  // brings the stats up to date: the last frame may have left blocks empty
  candidate_->outline();
  const MapStats expected_stats = reference_->stats(), actual_stats = candidate_->stats();
  ASSERT_EQ(actual_stats.blocks, expected_stats.blocks);
  ASSERT_EQ(actual_stats.voxel_arrays, expected_stats.voxel_arrays);
  ASSERT_EQ(actual_stats.map_bytes, expected_stats.map_bytes);
  ASSERT_EQ(actual_stats.refused_blocks, expected_stats.refused_blocks);
  ASSERT_EQ(actual_stats.colour_bytes, expected_stats.colour_bytes);
  ASSERT_EQ(actual_stats.dropped_blocks, expected_stats.dropped_blocks);
  ASSERT_EQ(actual_stats.free_bytes, expected_stats.free_bytes);
  ASSERT_EQ(actual_stats.refused_cubes, expected_stats.refused_cubes);
  ASSERT_EQ(actual_stats.max_map_bytes, expected_stats.max_map_bytes);
}

void BackendPair::compareViews(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C) {
  const RenderedView expected = reference_->render(camera, T_W_C);
  const RenderedView actual = candidate_->render(camera, T_W_C);
  ASSERT_EQ(expected.depth_m.size(), actual.depth_m.size());
  ASSERT_EQ(expected.colours.size(), actual.colours.size());
  size_t different = 0;
  for (size_t i = 0; i < expected.depth_m.size(); ++i) {
    different += std::memcmp(&expected.depth_m[i], &actual.depth_m[i], sizeof(float)) != 0 ||
                 std::memcmp(&expected.normals_C[i], &actual.normals_C[i], sizeof(Vec3f)) != 0;
    if (expected.colours.empty()) continue;
    different += std::memcmp(&expected.colours[i], &actual.colours[i], sizeof(VertexColour)) != 0;
  }
  EXPECT_EQ(different, 0u);
}

ClearedRegion BackendPair::clearRegion(const Region& region) {
  const ClearedRegion expected = reference_->clearRegion(region);
  const ClearedRegion actual = candidate_->clearRegion(region);
  EXPECT_EQ(actual.voxels, expected.voxels);
  EXPECT_EQ(actual.blocks, expected.blocks);
  compareStats();
  return actual;
}

void BackendPair::updateMesh() {
  beginMeshUpdate();
  finishMeshUpdate();
}

void BackendPair::beginMeshUpdate() {
  reference_->beginMeshUpdate();
  candidate_->beginMeshUpdate();
}

void BackendPair::finishMeshUpdate() {
  const MeshUpdate expected = reference_->finishMeshUpdate();
  const MeshUpdate actual = candidate_->finishMeshUpdate();
  expectEqualUpdates(expected, actual);
  reference_mesh_.apply(expected);
  candidate_mesh_.apply(actual);
}

void BackendPair::clear() {
  reference_->clear();
  candidate_->clear();
  reference_mesh_.clear();
  candidate_mesh_.clear();
}

void BackendPair::swapContents() {
  const MapContents expected = reference_->contents(), actual = candidate_->contents();
  ASSERT_NO_FATAL_FAILURE(expectEqualContents(expected, actual));
  reference_ = makeProbedMapper(reference_params_, rules_, actual);
  candidate_ = makeProbedMapper(candidate_params_, rules_, expected);
  reference_mesh_.clear();
  candidate_mesh_.clear();
}

void BackendPair::compareMaps() {
  expectEqualMaps(*reference_, *candidate_);
  expectEqualMeshes(reference_mesh_.assemble(), candidate_mesh_.assemble());
  if (reference_->space() != nullptr) compareSpaces();
}

void expectSpace(Mapper& mapper) {
  for (const CellState state : {CellState::kFree, CellState::kSurface}) {
    EXPECT_GT(countCells(mapper, state), 100u);
  }
}

size_t countCells(Mapper& mapper, CellState state) {
  const std::vector<SpaceCell> cells = mapper.space()->cells();
  return static_cast<size_t>(std::count_if(
      cells.begin(), cells.end(), [state](const SpaceCell& cell) { return cell.state == state; }));
}

void BackendPair::compareSpaces() {
  ASSERT_NE(reference_->space(), nullptr);
  ASSERT_NE(candidate_->space(), nullptr);
  expectEqualSpaces(*reference_->space(), *candidate_->space());
}

void expectEqualUpdates(const MeshUpdate& expected, const MeshUpdate& actual) {
  ASSERT_EQ(actual.blocks.size(), expected.blocks.size());
  for (size_t i = 0; i < expected.blocks.size(); ++i) {
    ASSERT_TRUE(sameBlockMesh(expected.blocks[i], actual.blocks[i]))
        << describe(expected.blocks[i].key) << ", found " << describe(actual.blocks[i].key) << ": "
        << expected.blocks[i].vertices.size() << " vertices, found "
        << actual.blocks[i].vertices.size() << ", " << expected.blocks[i].triangles.size() / 3
        << " triangles, found " << actual.blocks[i].triangles.size() / 3;
  }
}

void expectEqualMeshes(const Mesh& expected, const Mesh& actual) {
  EXPECT_EQ(actual.vertices_m.size(), expected.vertices_m.size());
  EXPECT_EQ(actual.triangles.size(), expected.triangles.size());
  EXPECT_TRUE(sameBytes(expected.vertices_m, actual.vertices_m));
  EXPECT_TRUE(sameBytes(expected.normals, actual.normals));
  EXPECT_TRUE(sameBytes(expected.triangles, actual.triangles));
  EXPECT_TRUE(sameBytes(expected.colours, actual.colours));
}

void expectEqualMaps(ProbedMapper& expected, ProbedMapper& actual) {
  const std::vector<BlockSnapshot> a = snapshotOf(expected), b = snapshotOf(actual);
  ASSERT_EQ(b.size(), a.size());
  for (size_t i = 0; i < a.size(); ++i) {
    ASSERT_TRUE(a[i].key == b[i].key) << describe(a[i].key) << " and " << describe(b[i].key);
    for (int d = 0; d < kDirectionCount; ++d) {
      ASSERT_TRUE(sameBytes(a[i].voxels[d], b[i].voxels[d]))
          << describe(a[i].key) << ", direction " << d << ": "
          << firstDifference(a[i].voxels[d], b[i].voxels[d]);
      ASSERT_TRUE(sameBytes(a[i].colours[d], b[i].colours[d]))
          << describe(a[i].key) << ", colours of direction " << d;
    }
  }
}

void expectEqualSpaces(Space& expected, Space& actual) {
  const std::vector<SpaceCell> a = expected.cells(), b = actual.cells();
  ASSERT_EQ(b.size(), a.size());
  expected.updateDistances();
  actual.updateDistances();
  const double side_m = expected.cellSize_m();
  for (size_t i = 0; i < a.size(); ++i) {
    const Vec3i& cell = a[i].cell;
    ASSERT_TRUE(cell == b[i].cell) << describe(cell) << " and " << describe(b[i].cell);
    ASSERT_EQ(static_cast<int>(b[i].state), static_cast<int>(a[i].state)) << describe(cell);
    ASSERT_EQ(actual.squaredDistance(cell), expected.squaredDistance(cell)) << describe(cell);
    if (i % 64 != 0) continue;
    const Eigen::Vector3d p_W = side_m * Eigen::Vector3d(cell.x + 0.3, cell.y - 0.8, cell.z + 1.9);
    const SpaceDistance here = expected.distanceAt(p_W), there = actual.distanceAt(p_W);
    ASSERT_EQ(there.known, here.known);
    ASSERT_EQ(there.distance_m, here.distance_m);
    ASSERT_EQ(std::memcmp(&there.gradient, &here.gradient, sizeof(Vec3f)), 0);
  }
}

void expectEqualContents(const MapContents& expected, const MapContents& actual) {
  ASSERT_EQ(actual.settings, expected.settings);
  ASSERT_EQ(actual.frames, expected.frames);
  ASSERT_EQ(actual.supporting_frames, expected.supporting_frames);
  ASSERT_EQ(actual.painted, expected.painted);
  ASSERT_EQ(actual.exposure, expected.exposure);
  ASSERT_EQ(actual.blocks.size(), expected.blocks.size());
  for (size_t i = 0; i < expected.blocks.size(); ++i) {
    const MapBlock &a = expected.blocks[i], &b = actual.blocks[i];
    ASSERT_TRUE(a.key == b.key) << describe(a.key) << " and " << describe(b.key);
    ASSERT_EQ(b.directions, a.directions) << describe(a.key);
    ASSERT_EQ(b.bricks, a.bricks) << describe(a.key);
  }
  ASSERT_EQ(actual.cell_voxels, expected.cell_voxels);
  ASSERT_EQ(actual.free_cubes.size(), expected.free_cubes.size());
  for (size_t i = 0; i < expected.free_cubes.size(); ++i) {
    const MapFreeCube &a = expected.free_cubes[i], &b = actual.free_cubes[i];
    ASSERT_TRUE(a.key == b.key && a.cells == b.cells) << describe(a.key);
  }
  ASSERT_TRUE(sameBytes(actual.voxels, expected.voxels));
  ASSERT_TRUE(sameBytes(actual.colours, expected.colours));
}

bool isAllocation(const std::string& message) {
  return message.find("cudaHostAlloc(") != std::string::npos ||
         message.find("cudaMalloc(") != std::string::npos;
}

}  // namespace dtsdf
