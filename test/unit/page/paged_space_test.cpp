// Tests a free-space grid that is paged to disk together with its map. All query results equal
// those without paging, and apart from an index, memory does not grow with the distance travelled.
#include <gtest/gtest.h>

#include <random>

#include "dtsdf_mapping/region.h"
#include "io/map_chunks.h"
#include "map/memory_budget.h"
#include "map/region_view.h"
#include "space/space_follower.h"
#include "space/space_map.h"
#include "support/depth_frames.h"
#include "support/map_equality.h"
#include "support/page_faults.h"
#include "support/random_seed.h"
#include "support/saved_maps.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr int kStepsOut = 45;  ///< Number of frames in each direction.

/// Pose i of a camera that moves along a corridor and back, facing alternately left and right of
/// the direction of motion.
Eigen::Isometry3d poseInCorridor(int i) {
  const int step = i < kStepsOut ? i : 2 * kStepsOut - i;
  const Vector3d eye(1.0 * step, 0.2 * (i % 3) - 0.2, 0.1 * (i % 2));
  const double aside = i % 2 == 0 ? 1.0 : -1.0, ahead = i < kStepsOut ? 1.0 : -1.0;
  return lookAt(eye, eye + Vector3d(ahead, aside, -0.1), Vector3d::UnitZ());
}

const std::vector<SceneFrame>& corridor() {
  static const std::vector<SceneFrame> frames = [] {
    std::vector<SceneFrame> made;
    for (int i = 0; i < 2 * kStepsOut; ++i) {
      Scene scene;
      scene.add(
          Room{Eigen::Vector3d(-2.0, -1.5, -1.2), Eigen::Vector3d(kStepsOut + 3.0, 1.5, 1.2)});
      for (int k = 0; k < kStepsOut / 5; ++k) {
        if (i > kStepsOut && k % 2 == 0) continue;  // these boxes disappear on the way back
        scene.add(makeBox({5.0 * k, k % 2 == 0 ? 1.0 : -1.0, -0.4}, {0.4, 0.3, 0.9}, 0.4));
      }
      made.push_back(renderFrame(scene, poseInCorridor(i), 80, 60));
    }
    return made;
  }();
  return frames;
}

MapperParams plainParams() {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.05f);
  params.fusion.max_depth_m = 3.0f;
  params.space.enabled = true;
  params.space.cell_voxels = 2;
  params.space.max_range_m = 3.0f;
  params.space.max_distance_m = 1.5f;
  params.mesh.min_support = 1;
  return params;
}

/// A mapper and a follower of its free-space grid, as in the node.
class Walk {
 public:
  explicit Walk(const MapperParams& params)
      : mapper_(makeProbedMapper(params)),
        pages_(makePages(params, size_t{512} << 10)),
        follower_(params.space.max_distance_m, 2, pages_) {}

  void go(int first = 0, int last = 2 * kStepsOut) {
    for (int i = first; i < last; ++i) {
      ASSERT_EQ(mapper_->integrate(corridor()[static_cast<size_t>(i)].view()).status,
                FrameStatus::kFused);
      if (i % 3 == 2) look();
    }
  }
  void look() {
    mapper_->updateMesh();
    follower_.apply(mapper_->space()->takeChanges(), mapper_->space()->cellSize_m());
    mapper_->space()->updateDistances();
  }

  ProbedMapper& mapper() { return *mapper_; }
  Space& space() { return *mapper_->space(); }
  std::shared_ptr<const SpaceSnapshot> known() const { return follower_.snapshot(); }
  size_t followerBytes() const { return follower_.bytes(); }
  PagedValues::Stats followerPages() const { return follower_.pageStats(); }

 private:
  std::unique_ptr<ProbedMapper> mapper_;
  SharedPagedValues pages_;
  SpaceFollower follower_;
};

void expectSameAnswers(const KnownSpace& expected, const KnownSpace& actual) {
  std::mt19937 random(caseSeed(0));
  std::uniform_real_distribution<double> along(-3.0, kStepsOut + 4.0), aside(-2.5, 2.5);
  for (int i = 0; i < 3000; ++i) {
    const Vector3d p(along(random), aside(random), aside(random));
    const SpaceDistance a = expected.distanceAt(p), b = actual.distanceAt(p);
    ASSERT_EQ(a.known, b.known) << p.transpose();
    ASSERT_EQ(a.distance_m, b.distance_m) << p.transpose();
    ASSERT_EQ(a.gradient.x, b.gradient.x);
    ASSERT_EQ(a.gradient.y, b.gradient.y);
    ASSERT_EQ(a.gradient.z, b.gradient.z);
    ASSERT_EQ(expected.stateOf(expected.cellAt(p)), actual.stateOf(expected.cellAt(p)));
  }
  EXPECT_EQ(expected.cubes(-8, 8).size(), actual.cubes(-8, 8).size());
}

void expectSameSpace(Walk& expected, Walk& actual) {
  const std::vector<SpaceCell> a = expected.space().cells(), b = actual.space().cells();
  ASSERT_GT(a.size(), 10000u);
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(packKey(a[i].cell), packKey(b[i].cell));
    ASSERT_EQ(a[i].state, b[i].state);
  }
  ASSERT_NO_FATAL_FAILURE(expectSameAnswers(expected.space(), actual.space()));
  ASSERT_NO_FATAL_FAILURE(expectSameAnswers(*expected.known(), *actual.known()));
}

class PagedSpace : public testing::Test {
 protected:
  TemporaryFolder folder_;

  std::string savedBytes(Walk& walk, const std::string& name) {
    saveMapOf(walk.mapper(), {}, folder_ / name);
    return readBytes(folder_ / name);
  }
};

TEST_F(PagedSpace, EqualsUnpagedSpace) {
  Walk whole(plainParams());
  ASSERT_NO_FATAL_FAILURE(whole.go());
  for (const int budget_mb : {8, 2}) {
    SCOPED_TRACE(budget_mb);
    Walk near(pagedParams(plainParams(), budget_mb, folder_ / "pages"));
    ASSERT_NO_FATAL_FAILURE(near.go());
    whole.look();
    near.look();
    const MapStats stats = near.mapper().stats();
    EXPECT_GT(stats.pages.space_bytes, size_t{1} << 20) << "more cells should be on disk";
    EXPECT_GT(near.followerPages().bytes, size_t{1} << 20);
    EXPECT_EQ(stats.refused_cubes + stats.refused_blocks, 0u);
    EXPECT_EQ(stats.pages.lost + stats.pages.failures, 0u) << stats.pages.problem;
    ASSERT_NO_FATAL_FAILURE(expectSameSpace(whole, near));
    EXPECT_TRUE(savedBytes(whole, "a.dtsdf") == savedBytes(near, "b.dtsdf"));
  }
}

TEST_F(PagedSpace, MemoryDoesNotGrowWithDistance) {
  constexpr int kBudgetMb = 4;
  constexpr size_t kInMemory = (size_t{kBudgetMb} << 20) / 8, kWriting = size_t{1} << 20;
  Walk whole(plainParams()), near(pagedParams(plainParams(), kBudgetMb, folder_.path()));
  size_t most = 0, max_of_follower = 0;
  for (int i = 0; i < 2 * kStepsOut; i += 3) {
    ASSERT_NO_FATAL_FAILURE(near.go(i, i + 3));
    ASSERT_NO_FATAL_FAILURE(whole.go(i, i + 3));
    most = std::max(most, near.space().bytes());
    max_of_follower = std::max(max_of_follower, near.followerBytes());
  }
  const size_t index = near.mapper().stats().pages.index_bytes;
  EXPECT_LE(most, kInMemory + kWriting + index);
  EXPECT_LE(max_of_follower, kInMemory + kWriting + near.followerPages().index_bytes);
  EXPECT_GT(whole.space().bytes(), 3 * (kInMemory + kWriting))
      << "the walk should exceed the memory for cells";
  std::cout << "memory of the map's free-space grid: " << (most >> 10)
            << " KiB (unpaged: " << (whole.space().bytes() >> 10)
            << " KiB), its follower's: " << (max_of_follower >> 10)
            << " KiB (unpaged: " << (whole.followerBytes() >> 10) << " KiB)\n";
}

TEST_F(PagedSpace, CanBeLoadedBeyondTheBudget) {
  Walk whole(plainParams());
  ASSERT_NO_FATAL_FAILURE(whole.go());
  whole.look();
  const MapContents contents = whole.mapper().contents();
  const auto loaded =
      makeProbedMapper(pagedParams(plainParams(), 3, folder_.path()), Rules(), contents);
  while (loaded->finishMeshUpdate().is_part || loaded->updateMesh().is_part) {
  }
  loaded->space()->updateDistances();
  ASSERT_NO_FATAL_FAILURE(expectSameAnswers(whole.space(), *loaded->space()));
  EXPECT_EQ(loaded->contents().free_cubes.size(), contents.free_cubes.size());
  SpaceFollower follower(
      plainParams().space.max_distance_m, 1,
      makePages(pagedParams(plainParams(), 3, folder_.path()), size_t{512} << 10));
  follower.apply(loaded->space()->takeChanges(), loaded->space()->cellSize_m());
  ASSERT_NO_FATAL_FAILURE(expectSameAnswers(*whole.known(), *follower.snapshot()));
}

/// A large map is published in parts while it changes. Finally, the follower contains all cells.
TEST_F(PagedSpace, IsPublishedInParts) {
  MapContents contents = makeMapper(plainParams())->contents();
  for (int32_t i = 0; i < 70000; ++i) {
    contents.free_cubes.push_back({{i % 50, i / 50 % 50, i / 2500}, {uint64_t(i) + 1}});
  }
  SpaceMap whole(plainParams(), 1), near(pagedParams(plainParams(), 8, folder_.path()), 1);
  whole.restore(contents);
  near.restore(contents);
  EXPECT_LE(near.bytes(), size_t{3} << 20);
  SpaceFollower follower(1.5, 1);
  int parts = 0;
  for (bool is_part = true; is_part; ++parts) {
    const SpaceChanges changes = near.takeChanges(false);
    EXPECT_EQ(changes.begins_anew, parts == 0);
    EXPECT_LE(changes.cubes.size(), size_t{34000});
    is_part = changes.is_part;
    follower.apply(changes, near.cellSize_m());
    for (SpaceMap* const map : {&whole, &near}) {
      map->clearRegion(makeRegionView(SphereRegion{{10.0 * parts, 20.0, 5.0}, 4.0}, 0.05));
      map->addFree({{{parts, -1, -1}, {{~uint64_t{0}}}}});
    }
  }
  EXPECT_GE(parts, 3);
  follower.apply(near.takeChanges(false), near.cellSize_m());
  MapContents a, b;
  whole.copyTo(a);
  near.copyTo(b);
  ASSERT_EQ(a.free_cubes.size(), b.free_cubes.size());
  const auto known = follower.snapshot();
  EXPECT_EQ(known->cubes(-1000, 1000).size(), a.free_cubes.size());
  for (size_t i = 0; i < a.free_cubes.size(); ++i) {
    ASSERT_EQ(packKey(a.free_cubes[i].key), packKey(b.free_cubes[i].key));
    ASSERT_EQ(a.free_cubes[i].cells, b.free_cubes[i].cells);
    const Vec3i cell = firstCellOfCube(a.free_cubes[i].key);
    ASSERT_EQ(known->stateOf(cell), whole.stateOf(cell));
  }
}

/// Cells beyond the budget stay unknown and are counted; surfaces stay known.
TEST_F(PagedSpace, KeepsSurfacesWhenTheDiskIsFull) {
  MapperParams params = pagedParams(plainParams(), 64, folder_.path());
  params.map.page_max_gb = 0.002f;
  Walk whole(plainParams());
  ASSERT_NO_FATAL_FAILURE(whole.go(0, kStepsOut));
  params.map.max_memory_mb = 16;  // 2 MB in memory for cells, and 2 MB on disk
  Walk near(params);
  ASSERT_NO_FATAL_FAILURE(near.go(0, kStepsOut));
  const MapStats stats = near.mapper().stats();
  EXPECT_GT(stats.pages.failures, 0u);
  EXPECT_GT(stats.refused_cubes, 0u);
  EXPECT_NE(stats.pages.problem.find("map/page_max_gb"), std::string::npos) << stats.pages.problem;
  for (const SpaceCell& cell : whole.space().cells()) {
    const CellState state = near.space().stateOf(cell.cell);
    if (cell.state == CellState::kSurface) {
      ASSERT_EQ(state, cell.state);
    }
    ASSERT_TRUE(state == cell.state || state == CellState::kUnknown);
  }
}

}  // namespace
}  // namespace dtsdf
