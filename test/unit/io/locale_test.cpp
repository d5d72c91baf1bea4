// Tests that numbers in files and messages use a decimal point even if the host program, for
// example one that uses Qt, has set a C or C++ locale with a decimal comma.
#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <locale>
#include <stdexcept>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/io/yaml_params.h"
#include "dtsdf_mapping/mapper.h"
#include "io/camera_file.h"
#include "io/trajectory.h"
#include "params/text.h"
#include "support/run_program.h"

namespace dtsdf {
namespace {

class DecimalComma : public testing::Test {
 protected:
  void SetUp() override {
    static const Outcome made =
        runIn(locales(), "localedef -i de_DE -f UTF-8 " + locales() / "de_DE.UTF-8");
    setenv("LOCPATH", locales().path().c_str(), 1);
    if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr) {
      GTEST_SKIP() << "cannot generate a locale with a decimal comma: " << made.err;
    }
    std::locale::global(std::locale("de_DE.UTF-8"));
    ASSERT_EQ(std::to_string(0.5), "0,500000");
  }
  void TearDown() override {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
  }

  const TemporaryFolder folder_;

 private:
  static const TemporaryFolder& locales() {
    static const TemporaryFolder folder;
    return folder;
  }
};

TEST_F(DecimalComma, DoesNotAffectMapFiles) {
  MapperParams params;
  params.map.voxel_size_m = 0.0125f;
  saveMap(makeMapper(params)->contents(), folder_ / "map.dtsdf");
  EXPECT_EQ(std::get<double>(readMapInfo(folder_ / "map.dtsdf").settings.at("map/voxel_size_m")),
            0.0125);
  EXPECT_EQ(loadMap(folder_ / "map.dtsdf", params).frames, 0u);
}

TEST_F(DecimalComma, DoesNotAffectSettings) {
  EXPECT_EQ(std::get<double>(parseYamlParams("a: 0.25", "test").at("a")), 0.25);
  EXPECT_EQ(toString(ParamValue(1234.5)), "1234.5");
  ParamReader reader({{"a", 1500.5}});
  double number = 0.0;
  reader("a", number, Range{0.25, 0.5});
  EXPECT_EQ(errorOf([&] { reader.finish(); }),
            "invalid settings:\n  a = 1500.5: must be from 0.25 to 0.5");
}

TEST_F(DecimalComma, DoesNotAffectPosesCamerasOrMeshes) {
  StampedPose pose{1234567.25, Eigen::Isometry3d::Identity()};
  pose.T_W_C.translation().x() = 1000.5;
  saveTrajectory({pose}, folder_ / "poses.txt");
  const Trajectory poses = readTrajectory(folder_ / "poses.txt", "");
  EXPECT_EQ(poses.poses().at(0).stamp_s, pose.stamp_s);
  EXPECT_EQ(poses.poses().at(0).T_W_C.translation().x(), 1000.5);

  const std::string text = cameraInfoText({640, 480, {525.5f, 524.5f, 319.5f, 239.5f}}, "test");
  EXPECT_NE(text.find("data: [525.5, 0, 319.5, "), std::string::npos) << text;

  Mesh mesh;
  mesh.vertices_m = {{1000.5f, 0.0f, 0.0f}, {0.0f, 1.5f, 0.0f}, {0.0f, 0.0f, 1.0f}};
  mesh.triangles = {{0, 1, 2}};
  saveMesh(mesh, MeshColour::kPlain, folder_ / "mesh.obj");
  EXPECT_NE(readBytes(folder_ / "mesh.obj").find("v 1000.5 0 0"), std::string::npos);
}

}  // namespace
}  // namespace dtsdf
