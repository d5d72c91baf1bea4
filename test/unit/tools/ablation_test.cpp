/// Runs every settings file of scripts/ablation on a scene that needs the rule it takes out.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"
#include "tools/run_options.h"

namespace dtsdf {
namespace {

/// A wall 2.2 m away, a box and a ball before it, a rod that is one pixel wide, and noise.
SceneFrame renderView(double x_m, bool with_small_ball, double noise) {
  Scene scene;
  scene.add(Plane{{0.0, 0.0, 2.2}, Eigen::Vector3d(0.2, -0.1, -1.0).normalized()});
  scene.add(makeBox({-0.1, 0.1, 0.6}, {0.3, 0.3, 0.4}, 0.4));
  scene.add(Rod{{0.3, -1.0, 1.0}, {0.3, 1.0, 1.0}, 0.004});
  scene.add(Sphere{{-0.5, -0.3, 1.5}, 0.3});
  if (with_small_ball) scene.add(Sphere{{0.1, -0.15, 0.5}, 0.08});
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.translation().x() = x_m;
  SceneFrame frame = renderFrame(scene, T_W_C);
  std::mt19937 random(7);
  for (float& depth_m : frame.depth_m) {
    // Without std::normal_distribution, whose numbers are not the same everywhere.
    const double unit = static_cast<double>(random()) / 4294967296.0 - 0.5;
    depth_m += static_cast<float>(noise * unit) * depth_m * depth_m;
  }
  return frame;
}

const std::vector<SceneFrame>& frames() {
  static const std::vector<SceneFrame> rendered = [] {
    std::vector<SceneFrame> all;
    for (int i = 0; i < 8; ++i) {
      all.push_back(renderView(0.01 * i, i < 2, i % 2 == 0 ? 0.0 : 0.01));
    }
    return all;
  }();
  return rendered;
}

Mesh meshWith(const std::string& settings_path) {
  RunOptions options;
  options.config_path = settings_path;
  options.backend = "cpu";
  options.threads = 1;
  const RunSettings settings = readSettings(options);
  const auto mapper = makeProbedMapper(settings.params.mapper, settings.rules);
  for (const SceneFrame& frame : frames()) {
    const IntegrationResult result = mapper->integrate(frame.view());
    EXPECT_EQ(result.status, FrameStatus::kFused) << result.message;
  }
  MeshStore store(settings.params.mapper.map.voxel_size_m);
  store.apply(mapper->updateMesh());
  return store.assemble();
}

bool areEqual(const Mesh& a, const Mesh& b) {
  const auto same = [](const Vec3f& p, const Vec3f& q) {
    return p.x == q.x && p.y == q.y && p.z == q.z;
  };
  return a.triangles == b.triangles && a.vertices_m.size() == b.vertices_m.size() &&
         std::equal(a.vertices_m.begin(), a.vertices_m.end(), b.vertices_m.begin(), same);
}

std::vector<std::string> settingsFiles() {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(DTSDF_ABLATION_FOLDER)) {
    paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

class AblationFile : public testing::TestWithParam<std::string> {};

TEST_P(AblationFile, ChangesTheMesh) {
  static const Mesh as_it_is = meshWith("");
  const Mesh changed = meshWith(GetParam());
  EXPECT_GT(changed.triangles.size(), 1000u);
  EXPECT_FALSE(areEqual(changed, as_it_is));
}

INSTANTIATE_TEST_SUITE_P(Rules, AblationFile, testing::ValuesIn(settingsFiles()),
                         [](const testing::TestParamInfo<std::string>& info) {
                           return std::filesystem::path(info.param).stem().string();
                         });

}  // namespace
}  // namespace dtsdf
