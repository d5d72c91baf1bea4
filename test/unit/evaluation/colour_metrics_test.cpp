#include "evaluation/colour_metrics.h"

#include <gtest/gtest.h>

#include "dtsdf_mapping/io/recording.h"
#include "evaluation/depth_renderer.h"
#include "simulation/scene.h"
#include "support/temporary_folder.h"
#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

TriangleMesh colouredRectangle(const Rgb8& colour) {
  TriangleMesh mesh = makeRectangle(-1, -1, 1, 1, 0);
  mesh.colours.assign(mesh.vertices.size(), colour);
  return mesh;
}

/// Reference values of the CIE L*a*b* colour space.
TEST(Lab, MatchesKnownColours) {
  const auto expectLab = [](const Eigen::Vector3d& rgb, const Eigen::Vector3d& lab) {
    EXPECT_LT((toLab(rgb) - lab).norm(), 0.05) << toLab(rgb).transpose();
  };
  expectLab({255, 255, 255}, {100.0, 0.0, 0.0});
  expectLab({0, 0, 0}, {0.0, 0.0, 0.0});
  expectLab({255, 0, 0}, {53.24, 80.09, 67.20});
  expectLab({0, 0, 255}, {32.30, 79.19, -107.86});
  expectLab({119, 119, 119}, {50.03, 0.0, 0.0});
}

TEST(ColourEvaluation, MeasuresAChannelDifference) {
  const ColourEvaluation result =
      evaluateColours(colouredRectangle({110, 100, 100}), colouredRectangle({100, 100, 100}),
                      Texture::kVertices, 1000);
  EXPECT_NEAR(result.rmse_rgb, 10.0 / std::sqrt(3.0), 1e-3);
  EXPECT_NEAR(result.rmse_lab, (toLab({110, 100, 100}) - toLab({100, 100, 100})).norm(), 1e-3);
  EXPECT_NEAR(result.median_lab, result.rmse_lab, 1e-3);
}

/// Vertices coloured with the texture itself must have almost no error.
TEST(ColourEvaluation, ComparesWithTheTexture) {
  TriangleMesh mesh = makeRectangle(-0.005f, -0.005f, 0.005f, 0.005f, 0);
  for (const Eigen::Vector3f& p : mesh.vertices) {
    mesh.colours.push_back(textureColour(Texture::kGradient, mesh, 0, p));
  }
  const auto rmseOf = [&](Texture texture) {
    return evaluateColours(mesh, makeRectangle(-1, -1, 1, 1, 0), texture, 20000).rmse_rgb;
  };
  EXPECT_LT(rmseOf(Texture::kGradient), 1.0);
  EXPECT_GT(rmseOf(Texture::kChecker), 10.0);
}

/// Pixels and poses of the colour camera must be unchanged after writing and reading a recording.
TEST(RenderColours, AreReadBackFromARecording) {
  const TriangleMesh mesh = colouredRectangle({200, 100, 50});
  const MeshScene scene(mesh);
  ViewCamera camera;
  camera.width = 32;
  camera.height = 24;
  camera.intrinsics = {30.0f, 30.0f, 15.5f, 11.5f};
  const Eigen::Isometry3d T_W_C = lookAt({0, 0, 4}, {0, 0, 0}, Eigen::Vector3d::UnitY());
  const Eigen::Isometry3d T_W_colour = T_W_C * Eigen::Translation3d(0.1, 0.0, 0.0);
  const TemporaryFolder folder;
  const TumWriter writer(folder.path(), camera, {T_W_C}, 10.0, {T_W_colour});
  writer.write(0, toTumDepth(renderView(scene, camera, T_W_C).depth_m));
  writer.writeColours(0, renderColours(scene, Texture::kVertices, camera, T_W_colour));
  writer.finish("test");
  RecordingOptions recording;
  recording.path = folder.path();
  const auto image = openRecordingColours(recording)->next();
  ASSERT_TRUE(image);
  EXPECT_TRUE(image->colour.T_W_C.isApprox(T_W_colour, 1e-6));
  const auto* pixels = static_cast<const uint8_t*>(image->colour.data);
  const size_t middle = 3 * (12 * 32 + 16);
  EXPECT_EQ(std::vector<int>(pixels + middle, pixels + middle + 3),
            (std::vector<int>{200, 100, 50}));
  EXPECT_EQ(pixels[0], 127);  // outside the rectangle
}

}  // namespace
}  // namespace dtsdf
