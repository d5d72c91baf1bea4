/// Tests `map_tool diff` and `map_tool hash` on maps of a room with and without a ball.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "dtsdf_mapping/io/map_file.h"
#include "params/text.h"
#include "support/depth_frames.h"
#include "support/run_program.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

class MapToolDiff : public testing::Test {
 protected:
  /// Maps the room, with or without the ball, from six poses. The map is shifted by `shift`.
  void save(const std::string& name, bool with_ball, const Vector3d& shift = Vector3d::Zero(),
            bool with_space = true) {
    MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f);
    params.space.enabled = with_space;
    params.space.cell_voxels = 2;
    params.mesh.min_support = 1;
    Scene room;
    room.add(Room{Eigen::Vector3d(-1.49, -1.18, -0.97), Eigen::Vector3d(1.51, 1.22, 1.03)});
    const auto mapper = makeMapper(params);
    for (int i = 0; i < 6; ++i) {
      const double a = i * M_PI / 3.0;
      auto pose = lookAt(Vector3d(1.2 * std::cos(a), 0.9 * std::sin(a), 0.2),
                         Vector3d(0.0, 0.0, -0.1), Vector3d::UnitZ());
      SceneFrame frame = renderFrame(with_ball ? makeBallRoom() : room, pose);
      frame.frame.T_W_C.pretranslate(shift);
      mapper->integrate(frame.view());
    }
    MapContents contents = mapper->contents();
    contents.map_frame = name == "elsewhere" ? "odom" : "map";
    saveMap(contents, out_ / (name + ".dtsdf"));
  }

  Outcome run(const std::string& arguments) {
    return runIn(out_, DTSDF_MAP_TOOL " " + arguments + " --set backend=cpu");
  }

  Outcome diff(const std::string& a, const std::string& b, const std::string& more = "") {
    return run("diff " + (out_ / (a + ".dtsdf")) + " " + (out_ / (b + ".dtsdf")) + " --mesh " +
               (out_ / "diff.ply") + " " + more);
  }

  /// The number after a word at the start of a line.
  static double valueOf(const std::string& word, const std::string& text) {
    const size_t at = ("\n" + text).find("\n" + word);
    EXPECT_NE(at, std::string::npos) << word << " is not in: " << text;
    return std::strtod(text.c_str() + at + word.size(), nullptr);
  }

  TemporaryFolder out_;
};

constexpr double kBall_m2 = 4.0 * M_PI * 0.35 * 0.35;

TEST_F(MapToolDiff, SwappingMapsSwapsGoneAndAdded) {
  save("ball", true);
  save("empty", false);
  const Outcome gone = diff("ball", "empty");
  ASSERT_EQ(gone.exit_code, 0) << gone.err;
  const double gone_m2 = valueOf("gone", gone.out);
  EXPECT_GT(gone_m2, 0.8 * kBall_m2) << gone.out;  // the underside of the ball is never visible
  EXPECT_LT(gone_m2, 1.05 * kBall_m2) << gone.out;
  EXPECT_EQ(valueOf("added", gone.out), 0.0);
  EXPECT_GT(valueOf("unchanged", gone.out), 20.0) << gone.out;
  const Outcome far = diff("ball", "empty", "--tolerance 0.6");
  EXPECT_GT(valueOf("gone", far.out), 0.1 * kBall_m2) << far.out;  // far from the walls
  const Outcome added = diff("empty", "ball", "--changes-only");
  ASSERT_EQ(added.exit_code, 0) << added.err;
  EXPECT_EQ(valueOf("added", added.out), gone_m2);
  EXPECT_EQ(valueOf("gone", added.out), 0.0);
  EXPECT_EQ(valueOf("unknown in A", added.out), valueOf("unknown in B", gone.out));
}

TEST_F(MapToolDiff, IgnoresShiftsWithinTheTolerance) {
  save("ball", true);
  save("moved", true, Vector3d(0.03, -0.02, 0.02));
  const Outcome near = diff("ball", "moved");
  ASSERT_EQ(near.exit_code, 0) << near.err;
  EXPECT_EQ(valueOf("added", near.out), 0.0) << near.out;
  EXPECT_EQ(valueOf("gone", near.out), 0.0) << near.out;
  const Outcome strict = diff("ball", "moved", "--tolerance 0.01");
  EXPECT_GT(valueOf("gone", strict.out), 0.1) << strict.out;
}

TEST_F(MapToolDiff, RefusesMapsThatCannotBeCompared) {
  save("ball", true);
  save("elsewhere", true);
  save("flat", true, Vector3d::Zero(), false);
  EXPECT_EQ(diff("ball", "flat").exit_code, 1);
  EXPECT_EQ(diff("ball", "elsewhere").exit_code, 1);
}

TEST_F(MapToolDiff, HashCoversTheMapAndItsMesh) {
  save("ball", true);
  save("again", true);
  save("empty", false);
  const auto hashOf = [&](const std::string& name) {
    const Outcome outcome = run("hash " + (out_ / name));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  };
  const std::string of_map = hashOf("ball.dtsdf");
  const uint64_t content = contentHash(loadMap(out_ / "ball.dtsdf"));
  EXPECT_EQ(of_map.find("map   " + formatted("%016llx", static_cast<unsigned long long>(content))),
            0u)
      << of_map;
  EXPECT_EQ(of_map, hashOf("again.dtsdf"));
  EXPECT_NE(of_map, hashOf("empty.dtsdf"));
  ASSERT_EQ(run("mesh " + (out_ / "ball.dtsdf") + " " + (out_ / "ball.ply")).exit_code, 0);
  EXPECT_EQ(of_map.substr(of_map.find("mesh")), hashOf("ball.ply"));
}

}  // namespace
}  // namespace dtsdf
