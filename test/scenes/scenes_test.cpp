// Maps analytic scenes with 20 mm and 10 mm voxels. The map must contain all surfaces visible to
// the camera and nothing else. lab/scenes defines the cases, their metrics and the limits.
#include <gtest/gtest.h>

#include <cctype>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "scenes/scene_case.h"

namespace dtsdf {
namespace {

std::vector<SceneCase> quickCases() {
  std::vector<SceneCase> quick;
  for (const SceneCase& c : allSceneCases()) {
    if (c.quick) quick.push_back(c);
  }
  return quick;
}

/// The cases that are also tested with 10 mm voxels. These belong to only four scenes, because each
/// case takes about twice as long as with 20 mm voxels. `scripts/prove scenes` tests all
/// scenes with both voxel sizes.
std::vector<SceneCase> casesAt10mm() {
  const std::set<std::string> scenes = {"near_after_far", "outlines", "slats", "uncontradicted"};
  std::vector<SceneCase> cases;
  for (const SceneCase& c : quickCases()) {
    if (scenes.count(c.scene) != 0) cases.push_back(c);
  }
  return cases;
}

/// gtest accepts only letters, digits and underscores in test names.
std::string testName(const testing::TestParamInfo<std::tuple<SceneCase, int>>& info) {
  std::string name;
  for (const char letter : std::get<0>(info.param).name()) {
    const bool plain = std::isalnum(static_cast<unsigned char>(letter)) != 0;
    if (plain || (!name.empty() && name.back() != '_')) name += plain ? letter : '_';
  }
  return name + "_at_" + std::to_string(std::get<1>(info.param)) + "mm";
}

/// Metrics known not to meet their limits, as pairs of "case, metric" and the voxel size in mm. The
/// list must not grow, and the test fails if a listed metric meets its limit.
const std::set<std::pair<std::string, int>>& knownMisses() {
  static const std::set<std::pair<std::string, int>> misses = {
#include "known_misses.inc"
  };
  return misses;
}

class Scenes : public testing::TestWithParam<std::tuple<SceneCase, int>> {};

TEST_P(Scenes, KeepTheirBounds) {
  const auto& [scene_case, voxel_mm] = GetParam();
  SceneSetup setup;
  setup.params.backend = Backend::kCpu;
  setup.params.threads = 1;  // ctest runs the parts in parallel
  setup.image_width = 160;   // for speed
  setup.params.map.voxel_size_m = static_cast<float>(0.001 * voxel_mm);  // as in prove_scenes
  for (const Figure& figure : scene_case.measure(setup)) {
    const std::string what = scene_case.name() + ", " + figure.name;
    const bool is_missed = knownMisses().count({what, voxel_mm}) != 0;
    EXPECT_NE(figure.holds(), is_missed)
        << what << ": " << figure.value << " " << figure.unit << ", wanted "
        << describeBound(figure)
        << (is_missed ? "; this limit is met now: remove the metric from known_misses.inc" : "");
  }
}

INSTANTIATE_TEST_SUITE_P(At20mm, Scenes,
                         testing::Combine(testing::ValuesIn(quickCases()), testing::Values(20)),
                         testName);
INSTANTIATE_TEST_SUITE_P(At10mm, Scenes,
                         testing::Combine(testing::ValuesIn(casesAt10mm()), testing::Values(10)),
                         testName);

}  // namespace

/// Makes gtest print the names of cases.
void PrintTo(const SceneCase& scene_case, std::ostream* out) { *out << scene_case.name(); }

}  // namespace dtsdf
