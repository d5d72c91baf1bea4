// Analytic scenes: whether the map holds what was seen, and only that, at 20 and 10 mm voxels. What
// a case shows, and the bounds of its figures, stand with it in src/scenes.
#include <gtest/gtest.h>

#include <cctype>
#include <tuple>

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

/// gtest takes letters, digits and underscores.
std::string testName(const testing::TestParamInfo<std::tuple<SceneCase, int>>& info) {
  std::string name;
  for (const char letter : std::get<0>(info.param).name()) {
    const bool plain = std::isalnum(static_cast<unsigned char>(letter)) != 0;
    if (plain || (!name.empty() && name.back() != '_')) name += plain ? letter : '_';
  }
  return name + "_at_" + std::to_string(std::get<1>(info.param)) + "mm";
}

class Scenes : public testing::TestWithParam<std::tuple<SceneCase, int>> {};

TEST_P(Scenes, KeepTheirBounds) {
  const auto& [scene_case, voxel_mm] = GetParam();
  SceneSetup setup;
  setup.params.backend = Backend::kCpu;
  setup.params.threads = 1;  // ctest runs the parts beside each other
  setup.image_width = 160;  // to be quick
  setup.params.map.voxel_size_m = 0.001f * static_cast<float>(voxel_mm);
  for (const Figure& figure : scene_case.measure(setup)) {
    EXPECT_TRUE(figure.holds()) << figure.name << ": " << figure.value << " " << figure.unit
                                << ", wanted " << describeBound(figure);
  }
}

INSTANTIATE_TEST_SUITE_P(At20mm, Scenes,
                         testing::Combine(testing::ValuesIn(quickCases()), testing::Values(20)),
                         testName);
INSTANTIATE_TEST_SUITE_P(At10mm, Scenes,
                         testing::Combine(testing::ValuesIn(quickCases()), testing::Values(10)),
                         testName);

}  // namespace

/// For gtest's messages.
void PrintTo(const SceneCase& scene_case, std::ostream* out) { *out << scene_case.name(); }

}  // namespace dtsdf
