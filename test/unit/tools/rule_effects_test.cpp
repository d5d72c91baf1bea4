/// Tests that each rule parameter for surfels, fusion and the mesh has an effect: the mesh changes
/// if the parameter is set to one end of its range or the other.
#include <gtest/gtest.h>

#include <random>

#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"

namespace dtsdf {
namespace {

constexpr size_t kWidth = 160;  // the default of renderFrame()

/// A wall at 2.2 m, with a box, a rod one pixel wide, and one or two balls in front of it. Part of
/// the noise is independent for each pixel, and part is common to neighbouring pixels.
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
  // std::normal_distribution is not the same on all platforms.
  std::mt19937 random(7);
  const auto unit = [&random] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  std::vector<double> shared(frame.depth_m.size());  // the same for all pixels of a 7 x 7 square
  for (double& value : shared) value = unit();
  for (size_t i = 0; i < frame.depth_m.size(); ++i) {
    const size_t square = i / kWidth / 7 * kWidth + i % kWidth / 7;
    float& depth_m = frame.depth_m[i];
    depth_m += static_cast<float>(noise * (unit() + 2.0 * shared[square])) * depth_m * depth_m;
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

Mesh meshWith(const Rules& rules) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.threads = 1;
  const auto mapper = makeProbedMapper(params, rules);
  for (const SceneFrame& frame : frames()) {
    const IntegrationResult result = mapper->integrate(frame.view());
    EXPECT_EQ(result.status, FrameStatus::kFused) << result.message;
  }
  MeshStore store(params.map.voxel_size_m);
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

/// Sets the rule parameter with the number `wanted` to an end of its range.
struct NumberSetter {
  int wanted;
  bool to_greatest;
  std::string key;
  int visited = 0;

  template <class Number>
  void operator()(const std::string& its_key, Number& number, const Range& range) {
    const bool shapes = its_key.rfind("rules/colour/") != 0 && its_key.rfind("rules/poses/") != 0;
    if (!shapes || visited++ != wanted) return;
    key = its_key;
    number = static_cast<Number>(to_greatest ? range.max : range.min);
  }
};

/// @return The rules, with one parameter at an end of its range, and the key of this parameter. The
/// key is empty if there is no such parameter.
std::pair<Rules, std::string> rulesWith(int wanted, bool to_greatest) {
  Rules rules;
  NumberSetter set{wanted, to_greatest, {}};
  visitRules(rules, set);
  return {rules, set.key};
}

TEST(RuleEffects, EachNumberChangesTheMesh) {
  const Mesh as_it_is = meshWith(Rules());
  EXPECT_GT(as_it_is.triangles.size(), 1000u);
  for (int i = 0; !rulesWith(i, false).second.empty(); ++i) {
    const auto [least, key] = rulesWith(i, false);
    EXPECT_TRUE(!areEqual(meshWith(least), as_it_is) ||
                !areEqual(meshWith(rulesWith(i, true).first), as_it_is))
        << key << " should change the mesh";
  }
}

}  // namespace
}  // namespace dtsdf
