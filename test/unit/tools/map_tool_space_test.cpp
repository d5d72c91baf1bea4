/// Tests `map_tool bt`, `map_tool slice` and `map_tool render` on a map that was saved with free
/// space.
#include <gtest/gtest.h>

#ifdef DTSDF_WITH_OCTOMAP
#include <octomap/OcTree.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/recording.h"
#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "io/trajectory.h"
#include "support/depth_frames.h"
#include "support/run_program.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

class MapToolSpace : public testing::Test {
 protected:
  static std::unique_ptr<Mapper> makeMap() {
    MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f);
    params.space.enabled = true;
    params.space.cell_voxels = 2;
    params.mesh.min_support = 1;
    auto mapper = makeMapper(params);
    for (int i = 0; i < 6; ++i) {
      const double a = i * M_PI / 3.0;
      const auto pose = lookAt(Vector3d(1.2 * std::cos(a), 0.9 * std::sin(a), 0.2),
                               Vector3d(0.0, 0.0, -0.1), Vector3d::UnitZ());
      mapper->integrate(renderFrame(makeBallRoom(), pose).view());
    }
    mapper->updateMesh();
    mapper->space()->updateDistances();
    return mapper;
  }

  void SetUp() override {
    mapper_ = makeMap();
    saveMap(mapper_->contents(), out_ / "room.dtsdf");
  }

  /// @return the exit code.
  int run(const std::string& arguments) {
    const Outcome outcome = runIn(out_, DTSDF_MAP_TOOL " " + arguments);
    errors_ = outcome.err;
    return outcome.exit_code;
  }

  TemporaryFolder out_;
  std::unique_ptr<Mapper> mapper_;
  std::string errors_;
};

TEST_F(MapToolSpace, ATreeHasTheCells) {
  const int result =
      run("bt " + (out_ / "room.dtsdf") + " " + (out_ / "room.bt") + " --set backend=cpu");
#ifdef DTSDF_WITH_OCTOMAP
  ASSERT_EQ(result, 0) << errors_;
  octomap::OcTree tree(out_ / "room.bt");
  const Space& space = *mapper_->space();
  EXPECT_NEAR(tree.getResolution(), space.cellSize_m(), 1e-6);  // six digits in the file
  size_t known = 0, free = 0;
  for (int x = -22; x <= 22; ++x) {
    for (int y = -18; y <= 18; ++y) {
      for (int z = -15; z <= 15; ++z) {
        const Vector3d p = space.cellSize_m() * Vector3d(x + 0.5, y + 0.5, z + 0.5);
        const octomap::OcTreeNode* const node = tree.search(p.x(), p.y(), p.z());
        const CellState state = node == nullptr              ? CellState::kUnknown
                                : tree.isNodeOccupied(*node) ? CellState::kSurface
                                                             : CellState::kFree;
        ASSERT_EQ(state, space.stateOf({x, y, z})) << x << " " << y << " " << z;
        if (state != CellState::kUnknown) ++known;
        if (state == CellState::kFree) ++free;
      }
    }
  }
  EXPECT_EQ(known, space.cells().size()) << "some cells were not compared";
  EXPECT_GT(free, 1000u);
#else
  EXPECT_EQ(result, 1);
  EXPECT_NE(errors_.find("liboctomap-dev"), std::string::npos) << errors_;
#endif
}

TEST_F(MapToolSpace, ASliceShowsUnknownSurfacesAndDistances) {
  ASSERT_EQ(run("slice " + (out_ / "room.dtsdf") + " " + (out_ / "room.png") +
                " --height 0.05 --pixels 3 --set backend=cpu"),
            0)
      << errors_;
  const RgbImage picture = readColourImage(out_ / "room.png");
  const Space& space = *mapper_->space();
  const int32_t z = space.cellAt(Vector3d(0.0, 0.0, 0.05)).z;
  std::map<std::pair<int, int>, CellState> cells;
  int32_t x0 = 1 << 30, y1 = -(1 << 30);
  for (const SpaceCell& known : space.cells()) {
    if (known.cell.z != z) continue;
    cells[{known.cell.x, known.cell.y}] = known.state;
    x0 = std::min(x0, known.cell.x);
    y1 = std::max(y1, known.cell.y);
  }
  const auto pixelAt = [&](int u, int v) {
    const size_t at =
        3 * (static_cast<size_t>(v) * static_cast<size_t>(picture.width) + static_cast<size_t>(u));
    return std::array<int, 3>{picture.values[at], picture.values[at + 1], picture.values[at + 2]};
  };
  size_t near_m = 0, far_m = 0;
  for (int v = 0; v < picture.height; ++v) {
    for (int u = 0; u < picture.width; ++u) {
      const int x = x0 + u / 3, y = y1 - v / 3;
      const auto cell = cells.find({x, y});
      const std::array<int, 3> rgb = pixelAt(u, v);
      const bool is_grey = rgb[0] == rgb[1] && rgb[1] == rgb[2];
      if (cell == cells.end()) {
        ASSERT_TRUE(is_grey && rgb[0] > 0) << u << ", " << v;
      } else if (cell->second == CellState::kSurface) {
        ASSERT_TRUE(is_grey && rgb[0] == 0) << u << ", " << v;
      } else {
        ASSERT_FALSE(is_grey) << u << ", " << v;
        const Vector3d p = space.cellSize_m() * Vector3d(x + 0.5, y + 0.5, 0.0);
        const float distance_m = space.distanceAt(Vector3d(p.x(), p.y(), 0.05)).distance_m;
        if (distance_m < 0.12f && ++near_m > 0) {
          EXPECT_GT(rgb[0], rgb[2]) << "red: " << distance_m;
        }
        if (distance_m > 0.6f && ++far_m > 0) {
          EXPECT_GT(rgb[2], rgb[0]) << "blue: " << distance_m;
        }
      }
    }
  }
  EXPECT_GT(near_m, 100u);
  EXPECT_GT(far_m, 100u);
}

/// A rendered view is a recording with its pose, and shows the map.
TEST_F(MapToolSpace, RendersARecording) {
  const auto T_W_C = lookAt(Vector3d(1.0, 0.2, 0.2), Vector3d(0.0, 0.0, -0.1), Vector3d::UnitZ());
  saveTrajectory({{2.5, T_W_C}}, out_ / "poses.txt");
  ASSERT_EQ(run("render " + (out_ / "room.dtsdf") + " " + (out_ / "views") + " --trajectory " +
                (out_ / "poses.txt") + " --set backend=cpu"),
            0)
      << errors_;
  RecordingOptions recording;
  recording.path = out_ / "views";
  const auto frame = openRecording(recording)->next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->stamp_s, 2.5);
  EXPECT_TRUE(frame->depth.T_W_C.isApprox(T_W_C, 1e-6));
  const RenderedView view = mapper_->render(RenderCamera(), T_W_C);
  const std::vector<uint16_t> depth =
      readDepthPng(out_ / "views/depth/000000.png", view.width, view.height);
  const RgbImage normals = readColourImage(out_ / "views/normals/000000.png");
  size_t seen = 0;
  for (size_t i = 0; i < depth.size(); ++i) {
    ASSERT_NEAR(depth[i] / 5000.0, view.depth_m[i], 1.01e-4) << i;
    if (depth[i] == 0) continue;
    ++seen;
    ASSERT_NEAR(normals.values[3 * i + 2], 128.0f + 127.0f * view.normals_C[i].z, 0.51f) << i;
  }
  EXPECT_GT(seen, depth.size() / 2);
}

TEST_F(MapToolSpace, SaysThatAMapHasNoFreeSpace) {
  const std::string slice = " " + (out_ / "room.png") + " --height 0.05 --set backend=cpu";
  EXPECT_EQ(run("slice " + (out_ / "room.dtsdf") + slice), 0) << errors_;
  EXPECT_EQ(errors_, "");
  MapContents contents = mapper_->contents();
  contents.free_cubes.clear();
  saveMap(contents, out_ / "surfaces.dtsdf");
  EXPECT_EQ(run("slice " + (out_ / "surfaces.dtsdf") + slice), 0) << errors_;
  EXPECT_NE(errors_.find("space/enabled=true"), std::string::npos) << errors_;
}

TEST_F(MapToolSpace, RefusesWrongArguments) {
  const std::string slice = "slice " + (out_ / "room.dtsdf") + " ";
  EXPECT_EQ(run(slice + (out_ / "room.png")), 2) << "the height is missing";
  EXPECT_EQ(run(slice + (out_ / "room.jpg") + " --height 0"), 2);
  EXPECT_EQ(run(slice + (out_ / "room.png") + " --height 30 --set backend=cpu"), 1);
  EXPECT_EQ(run("bt " + (out_ / "room.dtsdf") + " " + (out_ / "room.ot")), 2);
  EXPECT_EQ(run("bt " + (out_ / "none.dtsdf") + " " + (out_ / "room.bt")), 1);
}

}  // namespace
}  // namespace dtsdf
