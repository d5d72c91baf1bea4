// Tests that a map that is paged to disk equals, bit for bit, a map with enough memory.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <thread>

#include "dtsdf_mapping/partly_cleared.h"
#include "dtsdf_mapping/region.h"
#include "engine/pager.h"
#include "io/map_chunks.h"
#include "support/map_equality.h"
#include "support/page_faults.h"
#include "support/saved_maps.h"
#include "support/temporary_folder.h"

namespace {

/// Rate at which the disk reads and writes; 0 means unlimited.
std::atomic<double> disk_bytes_per_s{0.0};

/// If this is n > 0, reads that begin in one of every n sectors (256 bytes each) fail.
std::atomic<off_t> bad_sectors{0};

void takeTimeOfDisk(size_t bytes) {
  using Clock = std::chrono::steady_clock;
  static std::mutex mutex;
  static Clock::time_point free_at;
  const double rate = disk_bytes_per_s;
  if (rate <= 0.0) return;
  std::unique_lock<std::mutex> lock(mutex);
  const std::chrono::duration<double> needed(static_cast<double>(bytes) / rate);
  free_at = std::max(free_at, Clock::now()) + std::chrono::duration_cast<Clock::duration>(needed);
  const Clock::time_point until = free_at;
  lock.unlock();
  std::this_thread::sleep_until(until);
}

}  // namespace

// The program calls the following functions instead of the C library's pwrite() and pread().
extern "C" ssize_t pwrite(int file, const void* data, size_t bytes, off_t offset) {
  takeTimeOfDisk(bytes);
  return syscall(SYS_pwrite64, file, data, bytes, offset);
}
extern "C" ssize_t pread(int file, void* data, size_t bytes, off_t offset) {
  takeTimeOfDisk(bytes);
  if (const off_t bad = bad_sectors; bad > 0 && offset / 256 % bad == 7 % bad) {
    errno = EIO;
    return -1;
  }
  return syscall(SYS_pread64, file, data, bytes, offset);
}

namespace dtsdf {
namespace {

constexpr float kVoxel_m = 0.03f;
constexpr int kFramesOut = 18, kTourFrames = 36;

/// Pose i of a camera that moves along a corridor and back.
Eigen::Isometry3d poseAt(int i) {
  const int step = i < kFramesOut ? i : 2 * kFramesOut - i;
  const Eigen::Vector3d eye(0.7 * step, 0.2 * (i % 3) - 0.2, 0.1 * (i % 2));
  const double aside = i % 2 == 0 ? 1.2 : -1.2, ahead = i < kFramesOut ? 0.8 : -0.8;
  return lookAt(eye, eye + Eigen::Vector3d(ahead, aside, -0.1), Eigen::Vector3d::UnitZ());
}

const RoomRecording& tour() {
  static const RoomRecording recording = [] {
    RoomRecording made;
    for (int i = 0; i < kTourFrames; ++i) {
      Scene scene;
      scene.add(Room{Eigen::Vector3d(-1.5, -1.2, -0.9), Eigen::Vector3d(15.0, 1.2, 0.9)});
      for (int k = 0; k < 5; ++k) scene.add(makeBox({2.7 * k, 0.9, -0.4}, {0.4, 0.3, 0.9}, 0.4));
      if (i < kFramesOut) scene.add(makeBox({4.0, -0.9, 0.0}, {0.4, 0.4, 1.0}, 0.3));
      made.depth.push_back(renderFrame(scene, poseAt(i), 96, 72));
      made.colour.push_back(renderColour(scene, stripes, besideCamera(poseAt(i), 0.03), 96, 72));
    }
    return made;
  }();
  return recording;
}

/// What a tour does besides fusing depth images.
struct TourOptions {
  int mesh_every = 3;  ///< Frames between mesh updates; 0 means one update at the end.
  bool painted = false;
  bool space = false;
  float keep_radius_m = 0.0f;
};

MapperParams paramsOf(const TourOptions& options) {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, kVoxel_m);
  params.fusion.max_depth_m = 2.0f;
  params.max_paint_depth_m = 2.0f;
  params.map.keep_radius_m = options.keep_radius_m;
  params.space.enabled = options.space;
  return params;
}

Region boxInTheRoom() {
  BoxRegion region;
  region.T_W_B.translation() = Eigen::Vector3d(3.0, 1.0, 0.0);
  region.size_m = Eigen::Vector3d(4.0, 1.5, 1.0);
  return region;
}

size_t bytesOfMeshes(const MeshUpdate& update) {
  size_t bytes = 0;
  for (const BlockMesh& block : update.blocks) {
    bytes +=
        block.vertices.size() * sizeof(BlockVertex) + block.triangles.size() * sizeof(uint16_t);
  }
  return bytes;
}

/// A mapper that fuses the images of a tour, and the mesh assembled from its updates.
class Tour {
 public:
  Tour(const TourOptions& options, const MapperParams& params)
      : options_(options), mapper_(makeProbedMapper(params)), store_(kVoxel_m) {}

  void go(int first = 0, int last = kTourFrames) {
    for (int i = first; i < last; ++i) {
      const size_t n = static_cast<size_t>(i);
      const DepthFrame frame = tour().depth[n].view();
      ASSERT_EQ(mapper_->integrate(frame).status, FrameStatus::kFused);
      if (options_.painted) mapper_->paint(tour().colour[n].view());
      if (options_.mesh_every > 0 && i % options_.mesh_every == 0) updateMesh();
      max_ = std::max(max_, mapper_->stats().map_bytes);
    }
  }
  void updateMesh() { store_.apply(mapper_->updateMesh()); }
  /// Applies one part of an update, as the node does. @return Whether more parts follow.
  bool updatePart() {
    mapper_->beginMeshUpdate();
    const MeshUpdate update = mapper_->finishMeshUpdate();
    store_.apply(update);
    max_made_ = std::max(max_made_, bytesOfMeshes(update));
    return update.is_part;
  }
  /// Applies all parts of an update. @return The number of parts.
  int updateMeshInParts() {
    int parts = 1;
    while (updatePart()) ++parts;
    return parts;
  }
  size_t maxMade() const { return max_made_; }
  Mesh mesh() {
    updateMesh();
    return store_.assemble();
  }
  Mesh meshSoFar() const { return store_.assemble(); }
  ProbedMapper& mapper() { return *mapper_; }
  size_t most() const { return max_; }

 private:
  const TourOptions options_;
  std::unique_ptr<ProbedMapper> mapper_;
  MeshStore store_;
  size_t max_ = 0, max_made_ = 0;
};

class Paging : public testing::Test {
 protected:
  TemporaryFolder folder_;
};

/// The first mesh of a large map is extracted in parts, so that only one part is in memory at a
/// time.
TEST_F(Paging, MeshesALargeMapInParts) {
  TourOptions options;
  options.mesh_every = 0;
  Tour whole(options, paramsOf(options)),
      near(options, pagedParams(paramsOf(options), 2, folder_.path()));
  ASSERT_NO_FATAL_FAILURE(whole.go());
  ASSERT_NO_FATAL_FAILURE(near.go());
  EXPECT_EQ(whole.updateMeshInParts(), 1) << "a map in memory should be meshed at once";
  EXPECT_GT(near.updateMeshInParts(), 3);
  EXPECT_LT(near.maxMade(), whole.maxMade() / 3);
  EXPECT_TRUE(sameMeshes(near.meshSoFar(), whole.meshSoFar()));
  EXPECT_EQ(near.updateMeshInParts(), 1) << "an unchanged map should not be meshed again";
  EXPECT_TRUE(sameMeshes(near.meshSoFar(), whole.meshSoFar()));
  EXPECT_EQ(near.mapper().stats().refused_blocks, 0u);
}

/// Blocks with the greatest keys are meshed as well, even if a camera keeps changing other blocks.
TEST_F(Paging, MeshesAllPartsWhileACameraMaps) {
  TourOptions options;
  options.mesh_every = 0;
  Tour whole(options, paramsOf(options)),
      near(options, pagedParams(paramsOf(options), 2, folder_.path()));
  for (Tour* const map : {&whole, &near}) ASSERT_NO_FATAL_FAILURE(map->go());
  for (int part = 0; part < 30; ++part) {
    for (Tour* const map : {&whole, &near}) {
      ASSERT_NO_FATAL_FAILURE(map->go(part % 3, part % 3 + 1));
      map->updatePart();
    }
  }
  const size_t all = whole.meshSoFar().vertices_m.size();
  EXPECT_GT(near.meshSoFar().vertices_m.size(), all - all / 100);
}

/// Blocks are removed before the whole mesh is extracted again in parts.
TEST_F(Paging, RemovesBlocksFromAMeshInParts) {
  TourOptions options;
  options.mesh_every = 0;
  Tour whole(options, paramsOf(options)),
      near(options, pagedParams(paramsOf(options), 2, folder_.path()));
  for (Tour* const map : {&whole, &near}) {
    ASSERT_NO_FATAL_FAILURE(map->go());
    map->updateMeshInParts();
    map->mapper().paint(tour().colour[kTourFrames - 1].view());  // adds colours to all meshes
    EXPECT_GT(map->mapper().clearRegion(boxInTheRoom()).blocks, 0u);
    EXPECT_TRUE(map->updateMeshInParts() > 3 || map == &whole);
  }
  EXPECT_TRUE(sameMeshes(near.meshSoFar(), whole.meshSoFar()));
}

TEST_F(Paging, RendersBlocksOnDisk) {
  const TourOptions options;
  Tour whole(options, paramsOf(options)),
      near(options, pagedParams(paramsOf(options), 5, folder_.path()));
  whole.go();
  near.go();
  const RenderCamera camera{80, 60, {63.0f, 63.0f, 39.5f, 29.5f}};
  for (int i = 0; i < kTourFrames; i += 5) {
    const RenderedView a = whole.mapper().render(camera, poseAt(i));
    const RenderedView b = near.mapper().render(camera, poseAt(i));
    EXPECT_EQ(a.depth_m, b.depth_m);
  }
  EXPECT_TRUE(sameMaps(near.mapper(), whole.mapper()));
}

TEST_F(Paging, AlignsToBlocksOnDisk) {
  const TourOptions options;
  Tour whole(options, paramsOf(options)),
      near(options, pagedParams(paramsOf(options), 5, folder_.path()));
  whole.go();
  near.go();
  for (size_t i = 0; i < kTourFrames; i += 5) {
    const DepthFrame frame = tour().depth[i].view();
    const Alignment a = whole.mapper().align(frame, {0.05, 0.02});
    const Alignment b = near.mapper().align(frame, {0.05, 0.02});
    EXPECT_EQ(a.status, AlignmentStatus::kAligned);
    EXPECT_EQ(b.status, a.status);
    EXPECT_EQ(b.T_W_C.matrix(), a.T_W_C.matrix());
  }
}

/// A map larger than the budget is loaded and continued.
TEST_F(Paging, LoadsMapsLargerThanTheBudget) {
  TourOptions options;
  options.painted = true;
  Tour whole(options, paramsOf(options)), begun(options, paramsOf(options));
  whole.go();
  begun.go(0, kTourFrames / 2);
  const MapperParams params = pagedParams(paramsOf(options), 5, folder_.path());
  const auto resumed = makeProbedMapper(params, Rules(), begun.mapper().contents());
  EXPECT_LE(resumed->stats().map_bytes, resumed->stats().max_map_bytes);
  EXPECT_GT(resumed->stats().pages.blocks, 100u);
  for (int i = kTourFrames / 2; i < kTourFrames; ++i) {
    resumed->integrate(tour().depth[static_cast<size_t>(i)].view());
    resumed->paint(tour().colour[static_cast<size_t>(i)].view());
  }
  EXPECT_TRUE(sameContents(resumed->contents(), whole.mapper().contents()));
  MeshStore store(kVoxel_m);
  store.apply(resumed->updateMesh());
  EXPECT_TRUE(sameMeshes(store.assemble(), whole.mesh()));
  EXPECT_EQ(resumed->stats().refused_blocks, 0u);
}

/// Two places fit in memory. While a third place is mapped, blocks of the first place are written
/// to disk, but none of the second.
TEST_F(Paging, WritesTheOldestBlocksFirst) {
  const auto see = [](ProbedMapper& mapper, double x_m, double aside) {
    const Eigen::Vector3d eye(x_m, 0.0, 0.0);
    const Eigen::Isometry3d pose =
        lookAt(eye, eye + Eigen::Vector3d(0.0, aside, 0.0), Eigen::Vector3d::UnitZ());
    Scene scene;
    scene.add(Room{Eigen::Vector3d(-1.5, -1.2, -0.9), Eigen::Vector3d(15.0, 1.2, 0.9)});
    const SceneFrame image = renderFrame(scene, pose, 96, 72);
    ASSERT_EQ(mapper.integrate(image.view()).status, FrameStatus::kFused);
  };
  for (const double sign : {1.0, -1.0}) {  // block keys at the second place are greater or smaller
    const auto mapper = makeProbedMapper(pagedParams(paramsOf(TourOptions()), 2, folder_.path()));
    for (const double x_m : {6.0 - 4.0 * sign, 6.0 + 4.0 * sign}) {
      for (const double aside : {1.0, -1.0}) ASSERT_NO_FATAL_FAILURE(see(*mapper, x_m, aside));
    }
    ASSERT_EQ(mapper->stats().pages.written, 0u);
    ASSERT_NO_FATAL_FAILURE(see(*mapper, 6.0, 1.0));
    ASSERT_GT(mapper->stats().pages.written, 0u) << "some blocks should be written to disk";
    for (const double aside : {1.0, -1.0}) {
      ASSERT_NO_FATAL_FAILURE(see(*mapper, 6.0 + 4.0 * sign, aside));
    }
    EXPECT_EQ(mapper->stats().pages.read, 0u) << "the newer blocks should not be written";
  }
}

TEST_F(Paging, IsResetByClearing) {
  Tour near(TourOptions(), pagedParams(paramsOf(TourOptions()), 5, folder_.path()));
  near.go();
  near.mapper().clear();
  const MapStats stats = near.mapper().stats();
  EXPECT_EQ(stats.pages.blocks + stats.pages.bytes + stats.pages.written, 0u);
  EXPECT_EQ(stats.map_bytes_peak, 0u);
  near.go();
  Tour whole(TourOptions(), paramsOf(TourOptions()));
  whole.go();
  EXPECT_TRUE(sameMaps(near.mapper(), whole.mapper()));
}

/// Each map has a file of its own.
TEST_F(Paging, MapsCanShareAFolder) {
  const MapperParams params = pagedParams(paramsOf(TourOptions()), 5, folder_.path());
  Tour whole(TourOptions(), paramsOf(TourOptions())), first(TourOptions(), params),
      second(TourOptions(), params);
  whole.go();
  for (int i = 0; i < kTourFrames; ++i) {
    first.go(i, i + 1);
    second.go(i, i + 1);
  }
  EXPECT_TRUE(sameMaps(first.mapper(), whole.mapper()));
  EXPECT_TRUE(sameMaps(second.mapper(), whole.mapper()));
}

/// The blocks touched by a depth image stay in memory, however small the budget is. A colour image
/// paints only the blocks that fit.
TEST_F(Paging, ExceedsABudgetThatIsTooSmallForAnImage) {
  for (const bool painted : {false, true}) {
    SCOPED_TRACE(painted);
    TourOptions options;
    options.painted = painted;
    MapperParams params = paramsOf(options);
    params.max_paint_depth_m = 0.0f;
    Tour whole(options, params), near(options, pagedParams(params, 1, folder_.path()));
    for (Tour* map : {&whole, &near}) map->go();
    const MapStats stats = near.mapper().stats();
    EXPECT_EQ(stats.refused_blocks > 0, painted);
    EXPECT_GT(stats.map_bytes_peak, stats.max_map_bytes);
    EXPECT_LT(stats.map_bytes_peak, whole.mapper().stats().map_bytes_peak / 2);
    EXPECT_TRUE(painted || sameMaps(near.mapper(), whole.mapper()));
  }
}

/// When the disk is full, new blocks are refused and counted. Blocks already in the map stay.
TEST_F(Paging, RefusesNewBlocksWhenTheDiskIsFull) {
  const TourOptions options;
  MapperParams params = pagedParams(paramsOf(options), 4, folder_.path());
  params.map.page_max_gb = 0.003f;
  Tour near(options, params);
  near.go();
  near.updateMesh();
  const MapStats stats = near.mapper().stats();
  EXPECT_GT(stats.refused_blocks, 0u);
  EXPECT_LE(stats.map_bytes_peak, stats.max_map_bytes + stats.max_map_bytes / 8);
  EXPECT_LE(stats.pages.bytes, size_t(0.003 * (1 << 30)));
  EXPECT_EQ(stats.pages.lost, 0u);
  EXPECT_GT(stats.pages.failures, 0u);
  EXPECT_NE(stats.pages.problem.find("map/page_max_gb"), std::string::npos) << stats.pages.problem;
  EXPECT_EQ(near.mapper().contents().blocks.size(), stats.blocks + stats.pages.blocks);
}

/// When memory and disk are full, blocks beyond the radius are still dropped from the disk, whether
/// or not they have meshes.
TEST_F(Paging, DropsFarBlocksFromAFullDisk) {
  for (const bool meshed : {false, true}) {
    SCOPED_TRACE(meshed);
    TourOptions options;
    options.keep_radius_m = 9.0f;
    MapperParams params = pagedParams(paramsOf(options), 4, folder_.path());
    params.map.page_max_gb = 0.003f;
    const auto mapper = makeProbedMapper(params);
    const auto see = [&](int i, const Eigen::Vector3d& keep_center_W) {
      DepthFrame frame = tour().depth[static_cast<size_t>(i)].view();
      frame.keep_center_W = keep_center_W;
      ASSERT_EQ(mapper->integrate(frame).status, FrameStatus::kFused);
    };
    for (int i = 0; i < kFramesOut; ++i) see(i, {6.0, 0.0, 0.0});
    if (meshed) mapper->updateMesh();
    ASSERT_GT(mapper->stats().pages.failures, 0u) << "the disk should be full";
    const size_t on_disk = mapper->stats().pages.blocks;
    for (int i = 0; i < (meshed ? 2 : 1); ++i) see(kFramesOut - 1, {11.0, 0.0, 0.0});
    EXPECT_GT(mapper->stats().dropped_blocks, on_disk / 4);
    for (const MapBlock& block : mapper->outline().blocks) {
      ASSERT_GT(static_cast<float>(block.key.x + 1) * 8.0f * kVoxel_m, 2.0f);
    }
  }
}

/// With a 20 MB/s disk, fusion has to wait for the disk. The waits are counted, and the map is the
/// same.
TEST_F(Paging, WaitsForASlowDisk) {
  TourOptions options;
  options.space = true;
  Tour whole(options, paramsOf(options)),
      near(options, pagedParams(paramsOf(options), 3, folder_.path()));
  whole.go();
  disk_bytes_per_s = 40e6;
  near.go();
  EXPECT_TRUE(sameMeshes(near.mesh(), whole.mesh()));
  disk_bytes_per_s = 0.0;
  EXPECT_TRUE(sameMaps(near.mapper(), whole.mapper()));
  const PageStats pages = near.mapper().stats().pages;
  std::cout << pages.written << " blocks written, " << pages.read << " read, " << pages.waits
            << " waits, " << pages.wait_ms << " ms\n";
  EXPECT_GT(pages.waits, 0u);
  EXPECT_GT(pages.wait_ms, 10.0);
  EXPECT_EQ(pages.failures + pages.lost, 0u);
  EXPECT_EQ(near.mapper().stats().refused_blocks, 0u);
}

/// Clearing removes the blocks that can be read, and all free-space cells inside the region. An
/// exception reports that some blocks remain.
TEST_F(Paging, ClearsPartlyIfTheDiskFails) {
  TourOptions options;
  options.space = true;
  Tour near(options, pagedParams(paramsOf(options), 4, folder_.path()));
  int seen = 13;
  near.go(0, seen);
  BoxRegion region;
  region.size_m = Eigen::Vector3d(2.0, 3.0, 2.0);
  const auto free_cells = [&] {
    size_t count = 0;
    for (const SpaceCell& cell : near.mapper().space()->cells()) {
      const bool is_inside = std::abs(cell.cell.x) * near.mapper().space()->cellSize_m() < 0.5;
      count += is_inside && cell.state == CellState::kFree ? 1 : 0;
    }
    return count;
  };
  ASSERT_GT(free_cells(), 0u);
  {
    const FileSizeLimit disk(0);
    for (; near.mapper().stats().refused_blocks == 0; ++seen) {  // until memory is full
      ASSERT_LT(seen, kTourFrames);
      near.go(seen, seen + 1);
    }
    ASSERT_GT(near.mapper().stats().pages.failures, 0u);
    EXPECT_THROW(near.mapper().clearRegion(region), PartlyCleared);
  }
  EXPECT_EQ(free_cells(), 0u);
  near.go(seen, kTourFrames);
  EXPECT_GT(near.mapper().clearRegion(region).voxels, 0u);
  const MapContents contents = near.mapper().contents();
  EXPECT_EQ(near.mapper().clearRegion(region).voxels, 0u);
  const auto anew = makeProbedMapper(paramsOf(options), Rules(), contents);
  EXPECT_TRUE(sameMeshes(near.mesh(), meshOf(*anew, kVoxel_m)));
}

/// While the disk fails, blocks that do not fit are refused, and mapped blocks stay.
TEST_F(Paging, SurvivesTemporaryWriteFailures) {
  Tour near(TourOptions(), pagedParams(paramsOf(TourOptions()), 4, folder_.path()));
  near.go(0, 8);
  near.updateMesh();
  const size_t blocks = near.mapper().contents().blocks.size();
  ASSERT_EQ(near.mapper().stats().refused_blocks, 0u);
  {
    const FileSizeLimit disk(0);
    near.go(8, 14);
    near.go(0, 7);  // next to blocks on disk that do not fit in memory
    const uint64_t counted = near.mapper().stats().refused_blocks;
    near.updateMesh();
    EXPECT_GT(near.mapper().stats().refused_blocks, counted);
  }
  MapStats stats = near.mapper().stats();
  EXPECT_GT(stats.refused_blocks, 0u);
  EXPECT_GT(stats.pages.failures, 0u);
  EXPECT_NE(stats.pages.problem.find("map/page_folder"), std::string::npos);
  EXPECT_EQ(stats.pages.lost, 0u);
  EXPECT_GE(near.mapper().contents().blocks.size(), blocks) << "no block should be lost";
  for (int i = 0; i < 32; ++i) near.updateMesh();  // until writing is retried
  const auto anew = makeProbedMapper(paramsOf(TourOptions()), Rules(), near.mapper().contents());
  const uint64_t counted = near.mapper().stats().refused_blocks;
  EXPECT_TRUE(sameMeshes(near.mesh(), meshOf(*anew, kVoxel_m)))
      << "mesh updates during the failures should leave no errors";
  EXPECT_EQ(near.mapper().stats().refused_blocks, counted) << "all blocks should be readable";
  near.go(14, kTourFrames);
  near.go(kFramesOut, kTourFrames);
  const uint64_t refused = near.mapper().stats().refused_blocks;
  near.go(0, kTourFrames);
  stats = near.mapper().stats();
  EXPECT_EQ(stats.refused_blocks, refused) << "the disk should be used again";
}

/// Blocks that cannot be read for some time are not lost.
TEST_F(Paging, SurvivesATemporaryDiskOutage) {
  Tour near(TourOptions(), pagedParams(paramsOf(TourOptions()), 4, folder_.path()));
  near.go(0, kFramesOut);
  near.updateMesh();
  const size_t blocks = near.mapper().contents().blocks.size();
  {
    const DiskOutage outage(folder_.path());
    near.go(0, 2);
  }
  const MapStats stats = near.mapper().stats();
  EXPECT_EQ(stats.pages.lost, 0u);
  EXPECT_GT(stats.pages.failures, 0u);
  EXPECT_GE(near.mapper().contents().blocks.size(), blocks);
}

/// If a few sectors cannot be read, the blocks in them are lost, and the rest of the map is saved.
/// If no sector can be read, saving fails and nothing is lost.
TEST_F(Paging, SavesMapsDespiteAFewBadSectors) {
  Tour near(TourOptions(), pagedParams(paramsOf(TourOptions()), 4, folder_.path()));
  near.go(0, kFramesOut);
  near.updateMesh();
  const size_t before = near.mapper().contents().blocks.size();
  bad_sectors = 1;
  EXPECT_NE(errorOf([&] { near.mapper().contents(); }), "");
  EXPECT_EQ(near.mapper().stats().pages.lost, 0u);
  bad_sectors = 499;
  saveMapOf(near.mapper(), {}, folder_ / "saved.dtsdf");
  bad_sectors = 0;
  const uint64_t lost = near.mapper().stats().pages.lost;
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(loadMap(folder_ / "saved.dtsdf").blocks.size(), before - lost);
  EXPECT_TRUE(sameContents(loadMap(folder_ / "saved.dtsdf"), near.mapper().contents()));
}

/// Damaged blocks are lost and counted. Their meshes are removed, and the areas they covered can be
/// mapped again.
TEST_F(Paging, SurvivesDamage) {
  Tour near(TourOptions(), pagedParams(paramsOf(TourOptions()), 4, folder_.path()));
  near.go(0, kFramesOut);
  near.updateMesh();
  const size_t before = near.mapper().contents().blocks.size();
  damagePages(folder_.path(), 20, 100000);
  const MapContents copy = near.mapper().contents();
  MapStats stats = near.mapper().stats();
  EXPECT_GT(stats.pages.lost, 0u) << "blocks missing from the copy should be counted as lost";
  EXPECT_LE(stats.pages.lost, 20u);
  EXPECT_EQ(copy.blocks.size(), before - stats.pages.lost);
  EXPECT_TRUE(sameContents(near.mapper().contents(), copy));
  near.go(kFramesOut, kTourFrames);
  stats = near.mapper().stats();
  EXPECT_LE(stats.pages.lost, 20u);
  EXPECT_NE(stats.pages.problem.find("damaged"), std::string::npos) << stats.pages.problem;
  Mesh mesh = near.mesh();
  const auto anew = makeProbedMapper(paramsOf(TourOptions()), Rules(), near.mapper().contents());
  EXPECT_TRUE(sameMeshes(mesh, meshOf(*anew, kVoxel_m)))
      << "the mesh should be that of the remaining blocks";
}

/// Copying the same part again after damage has been detected returns the same intact blocks.
TEST_F(Paging, RepeatedCopiesOmitDamagedBlocks) {
  TourOptions options;
  options.painted = true;
  Tour near(options, pagedParams(paramsOf(options), 5, folder_.path()));
  near.go(0, kFramesOut);
  near.updateMesh();
  near.go(kFramesOut, kFramesOut + 1);  // updates the mesh once more
  damagePages(folder_.path(), 20, 100000);
  const std::vector<MapBlock> blocks = near.mapper().outline().blocks;
  const MapContents first = near.mapper().part(blocks);
  ASSERT_GT(near.mapper().stats().pages.lost, 0u) << "some blocks should be lost";
  const MapContents again = near.mapper().part(blocks);
  EXPECT_TRUE(sameContents(again, first));
  saveMapOf(near.mapper(), {}, folder_ / "saved.dtsdf");
  EXPECT_TRUE(sameContents(loadMap(folder_ / "saved.dtsdf"), near.mapper().contents()));
}

TEST_F(Paging, ReportsAnUnusableFolder) {
  writeBytes(folder_ / "file", "");
  MapperParams params = pagedParams(paramsOf(TourOptions()), 5, folder_ / "file");
  const std::string error = errorOf([&] { makeMapper(params); });
  EXPECT_NE(error.find("map/page_folder"), std::string::npos) << error;
  params.map.page_folder = folder_ / "made/for/it";
  EXPECT_EQ(errorOf([&] { makeMapper(params); }), "");
}

TEST_F(Paging, DoesNotChangeTheMapSettings) {
  const auto whole = makeMapper(paramsOf(TourOptions()));
  const auto near = makeMapper(pagedParams(paramsOf(TourOptions()), 5, folder_.path()));
  EXPECT_EQ(near->contents().settings, whole->contents().settings);
}

}  // namespace
}  // namespace dtsdf
