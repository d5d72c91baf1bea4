/// Tests `map_tool bt` and `map_tool render` on a map saved with its free-space grid.
#include <gtest/gtest.h>

#ifdef DTSDF_WITH_OCTOMAP
#include <octomap/OcTree.h>
#endif

#include <cmath>

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

TEST_F(MapToolSpace, OctreeMatchesTheCells) {
  const int result =
      run("bt " + (out_ / "room.dtsdf") + " " + (out_ / "room.bt") + " --set backend=cpu");
#ifdef DTSDF_WITH_OCTOMAP
  ASSERT_EQ(result, 0) << errors_;
  octomap::OcTree tree(out_ / "room.bt");
  const Space& space = *mapper_->space();
  EXPECT_NEAR(tree.getResolution(), space.cellSize_m(), 1e-6);  // the file has only six digits
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
  EXPECT_EQ(known, space.cells().size()) << "all cells should be compared";
  EXPECT_GT(free, 1000u);
#else
  EXPECT_EQ(result, 1);
  EXPECT_NE(errors_.find("liboctomap-dev"), std::string::npos) << errors_;
#endif
}

/// `render` writes a recording with the input poses. Its images equal rendered views of the map.
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

#ifdef DTSDF_WITH_OCTOMAP
TEST_F(MapToolSpace, WarnsIfAMapHasNoFreeSpace) {
  const std::string tree = " " + (out_ / "room.bt") + " --set backend=cpu";
  EXPECT_EQ(run("bt " + (out_ / "room.dtsdf") + tree), 0) << errors_;
  EXPECT_EQ(errors_.find("warning"), std::string::npos) << errors_;
  MapContents contents = mapper_->contents();
  contents.free_cubes.clear();
  saveMap(contents, out_ / "surfaces.dtsdf");
  EXPECT_EQ(run("bt " + (out_ / "surfaces.dtsdf") + tree), 0) << errors_;
  EXPECT_NE(errors_.find("space/enabled=true"), std::string::npos) << errors_;
}
#endif

TEST_F(MapToolSpace, RefusesWrongArguments) {
  EXPECT_EQ(run("bt " + (out_ / "room.dtsdf") + " " + (out_ / "room.ot")), 2);
  EXPECT_EQ(run("bt " + (out_ / "none.dtsdf") + " " + (out_ / "room.bt")), 1);
}

}  // namespace
}  // namespace dtsdf
