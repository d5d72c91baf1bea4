/// Tests `map_tool texture` on recordings of analytic scenes. The .obj and .glb files are read by
/// the test's own code, not by the package's readers.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "io/colour_codes.h"
#include "support/depth_frames.h"
#include "support/run_program.h"
#include "support/scene_colours.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// A corner of a triangle in an .obj file.
struct ObjCorner {
  Vector3d p_W, vertex_rgb, normal;
  double u, v;  ///< Measured from the lower left corner of the texture.
};

using ObjTriangle = std::array<ObjCorner, 3>;

std::vector<ObjTriangle> readObj(const std::string& path) {
  std::istringstream file(readBytes(path));
  std::vector<Vector3d> points, colours, normals;
  std::vector<std::array<double, 2>> places;
  std::vector<ObjTriangle> triangles;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    Vector3d a, b;
    if (kind == "v") {
      words >> a.x() >> a.y() >> a.z() >> b.x() >> b.y() >> b.z();
      points.push_back(a);
      colours.push_back(255.0 * b);
    } else if (kind == "vn") {
      words >> a.x() >> a.y() >> a.z();
      normals.push_back(a);
    } else if (kind == "vt") {
      words >> a.x() >> a.y();
      places.push_back({a.x(), a.y()});
    } else if (kind == "f") {
      ObjTriangle triangle;
      for (ObjCorner& corner : triangle) {
        size_t point = 0, place = 0, normal = 0;
        char slash = 0;
        words >> point >> slash >> place >> slash >> normal;
        corner = {points.at(point - 1), colours.at(point - 1), normals.at(normal - 1),
                  places.at(place - 1)[0], places.at(place - 1)[1]};
      }
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

/// The texel at the centre of a triangle.
Vector3d colourAtMiddle(const ObjTriangle& triangle, const RgbImage& texture) {
  double u = 0.0, v = 0.0;
  for (const ObjCorner& corner : triangle) {
    u += corner.u / 3.0;
    v += corner.v / 3.0;
  }
  const auto x = static_cast<size_t>(u * texture.width);
  const auto y = static_cast<size_t>((1.0 - v) * texture.height);
  const uint8_t* const rgb = &texture.values.at(3 * (y * static_cast<size_t>(texture.width) + x));
  return {static_cast<double>(rgb[0]), static_cast<double>(rgb[1]), static_cast<double>(rgb[2])};
}

class MapToolTexture : public testing::Test {
 protected:
  /// Writes a recording of a scene, fuses it, and textures the mesh of the map.
  void texture(const Scene& scene, const SurfaceColour& colour,
               const std::vector<Eigen::Isometry3d>& poses) {
    writeSceneRecording(out_ / "room", scene, poses, 320, 240);
    writeSceneColours(out_ / "room", scene, colour, poses, 320, 240);
    // Gives the colour images the poses' stamps.
    std::string list = readBytes(out_ / "room/depth.txt");
    for (size_t at = 0; (at = list.find("depth/")) != std::string::npos;) {
      list.replace(at, 5, "rgb");
    }
    writeBytes(out_ / "room/rgb.txt", list);
    const Outcome fused =
        runIn(out_, DTSDF_RECONSTRUCT " " + (out_ / "room") +
                        " --poses-mode tf --backend cpu --set map/voxel_size_m=0.04 "
                        "colour/exposure=fixed mesh/min_support=1 --save-map " +
                        (out_ / "room.dtsdf"));
    ASSERT_EQ(fused.exit_code, 0) << fused.err;
    const Outcome outcome = run("--mesh " + (out_ / "room.obj"));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    triangles_ = readObj(out_ / "room.obj");
    texture_ = readColourImage(out_ / "room_0.png");
    ASSERT_GT(triangles_.size(), 100u);
  }

  Outcome run(const std::string& arguments) {
    return runIn(out_, DTSDF_MAP_TOOL " texture " + (out_ / "room") + " " + (out_ / "room.dtsdf") +
                           " --set backend=cpu " + arguments);
  }

  TemporaryFolder out_;
  std::vector<ObjTriangle> triangles_;
  RgbImage texture_;
};

/// Waves with a period of 0.1 m, which 0.04 m voxels can hardly resolve.
Colour fineWavesAt(const Vector3d& p_W) {
  const auto wave = [](double x) { return static_cast<uint8_t>(128.0 + 100.0 * std::sin(x)); };
  return {wave(2.0 * M_PI * (p_W.x() + p_W.y()) / 0.1), wave(2.0 * M_PI * p_W.z() / 0.1), 90};
}

TEST_F(MapToolTexture, ResolvesDetailsFinerThanVoxels) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 8; ++i) {
    const double a = i * M_PI / 4.0;
    poses.push_back(lookAt(Vector3d(0.3 * std::cos(a), 0.3 * std::sin(a), 0.0),
                           Vector3d(1.5 * std::cos(a), 1.2 * std::sin(a), -0.1),
                           Vector3d::UnitZ()));
  }
  Scene room;
  room.add(Room{Eigen::Vector3d(-1.49, -1.18, -0.97), Eigen::Vector3d(1.51, 1.22, 1.03)});
  texture(room, fineWavesAt, poses);
  double of_texture = 0.0, of_vertices = 0.0;
  size_t count = 0;
  for (const ObjTriangle& triangle : triangles_) {
    Vector3d middle = Vector3d::Zero(), of_corners = Vector3d::Zero();
    for (const ObjCorner& corner : triangle) {
      middle += corner.p_W / 3.0;
      of_corners += corner.vertex_rgb / 3.0;
    }
    if (std::abs(middle.z()) > 0.3) continue;  // far above or below the cameras
    const Colour truth = fineWavesAt(middle);
    const Vector3d rgb(truth[0], truth[1], truth[2]);
    of_texture += (colourAtMiddle(triangle, texture_) - rgb).squaredNorm();
    of_vertices += (of_corners - rgb).squaredNorm();
    ++count;
  }
  ASSERT_GT(count, 1000u);
  EXPECT_LT(std::sqrt(of_texture / static_cast<double>(count)), 25.0);
  EXPECT_LT(of_texture, 0.25 * of_vertices) << "should be 6 dB better than vertex colours";
}

TEST_F(MapToolTexture, SeparatesTheSidesOfAThinPlate) {
  Scene plate;
  plate.add(makeBox({0.0, 0.0, 0.0}, {0.01, 0.6, 0.6}, 0.0));
  const SurfaceColour colour = [](const Vector3d& p_W) {
    return p_W.x() > 0.0 ? Colour{220, 30, 30} : Colour{30, 30, 220};
  };
  texture(plate, colour, sphereOfPoses(Vector3d::Zero(), 1.0, 16));
  size_t right = 0, wrong = 0;
  for (const ObjTriangle& triangle : triangles_) {
    const Vector3d& p_W = triangle[0].p_W;
    const double facing = triangle[0].normal.x();
    if (std::abs(p_W.y()) > 0.22 || std::abs(p_W.z()) > 0.22 || std::abs(facing) < 0.7) continue;
    const Vector3d rgb = colourAtMiddle(triangle, texture_);
    ++((rgb.x() > rgb.z()) == (facing > 0.0) ? right : wrong);
  }
  EXPECT_GT(right, 200u);
  EXPECT_EQ(wrong, 0u);
}

TEST_F(MapToolTexture, GlbMatchesObj) {
  texture(makeBallRoom(), wavesAt,
          {lookAt(Vector3d(-1.0, 0.0, 0.2), Vector3d(0.3, 0.1, 0.0), Vector3d::UnitZ())});
  const Outcome outcome = run("--mesh " + (out_ / "room.glb"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string bytes = readBytes(out_ / "room.glb");
  uint32_t json_bytes = 0;
  std::memcpy(&json_bytes, bytes.data() + 12, 4);
  const auto document = nlohmann::json::parse(bytes.substr(20, json_bytes));
  const std::string binary = bytes.substr(28 + json_bytes);
  ASSERT_EQ(binary.size(), document["buffers"][0]["byteLength"]);
  const auto viewAt = [&](size_t i) {
    const auto& view = document["bufferViews"][i];
    return binary.substr(view["byteOffset"], view["byteLength"]);
  };
  EXPECT_EQ(viewAt(document["images"][0]["bufferView"]), readBytes(out_ / "room_0.png"));
  const auto& attributes = document["meshes"][0]["primitives"][0]["attributes"];
  const std::string places =
      viewAt(document["accessors"][size_t{attributes["TEXCOORD_0"]}]["bufferView"]);
  ASSERT_EQ(places.size(), 24 * triangles_.size());
  std::vector<float> shares(places.size() / 4);
  std::memcpy(shares.data(), places.data(), places.size());
  for (size_t i = 0; i < shares.size(); i += 2) {
    const ObjCorner& corner = triangles_[i / 6][i / 2 % 3];
    ASSERT_NEAR(shares[i], corner.u, 1e-6);
    ASSERT_NEAR(shares[i + 1], 1.0 - corner.v, 1e-6);
  }
  // A pose far from the map, as if from another recording.
  const std::string list = readBytes(out_ / "room/depth.txt");
  const std::string stamp = list.substr(0, list.find(' '));
  writeBytes(out_ / "far.txt", stamp + " 100 0 0 0 0 0 1\n");
  EXPECT_EQ(run("--poses " + (out_ / "far.txt") + " --mesh " + (out_ / "far.obj")).exit_code, 1);
}

TEST_F(MapToolTexture, RefusesOtherFilesAndRecordingsWithoutColour) {
  EXPECT_EQ(run("--mesh " + (out_ / "room.ply")).exit_code, 2);
  writeSceneRecording(
      out_ / "room", makeBallRoom(),
      {lookAt(Vector3d(-1.0, 0.0, 0.2), Vector3d(0.3, 0.1, 0.0), Vector3d::UnitZ())});
  ASSERT_EQ(runIn(out_, DTSDF_RECONSTRUCT " " + (out_ / "room") +
                            " --backend cpu --set map/voxel_size_m=0.04 --save-map " +
                            (out_ / "room.dtsdf"))
                .exit_code,
            0);
  EXPECT_EQ(run("--mesh " + (out_ / "room.obj")).exit_code, 1);
}

}  // namespace
}  // namespace dtsdf
