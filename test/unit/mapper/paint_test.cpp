// Tests how colour images paint surfaces, on scenes with known colours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "mapper/probed_mapper.h"
#include "support/colour_frames.h"
#include "support/depth_frames.h"
#include "support/map_equality.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr Colour kRed{220, 30, 30}, kBlue{30, 30, 220}, kGreen{30, 200, 30}, kGrey{128, 128, 128};
constexpr double kPlateWidth_m = 0.5, kPlateThickness_m = 0.005;
constexpr int kWidth = 240, kHeight = 180;

/// A plate normal to the x axis in a green room: red in front (+x), blue behind, grey at the rim.
Scene plateScene() {
  Scene scene;
  scene.add(Room{Vector3d(-1.7, -1.7, -1.3), Vector3d(1.7, 1.7, 1.3)});
  scene.add(makeBox(Vector3d(0.0033, 0.0, 0.0),
                    Vector3d(kPlateThickness_m, kPlateWidth_m, kPlateWidth_m)));
  return scene;
}

bool isWithinPlate(const Vector3d& p_W, double margin_m) {
  const double half = 0.5 * kPlateWidth_m - margin_m;
  return std::abs(p_W.y()) < half && std::abs(p_W.z()) < half;
}

Colour plateColour(const Vector3d& p_W) {
  if (std::abs(p_W.x()) > 0.1 || !isWithinPlate(p_W, -0.01)) return kGreen;
  if (!isWithinPlate(p_W, 1e-6)) return kGrey;
  return p_W.x() > 0.0033 ? kRed : kBlue;
}

/// Poses around the plate, at `radius_m` from the z axis and varying heights.
std::vector<Eigen::Isometry3d> orbit(int count, double radius_m) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * 3.14159265358979 * (i + 0.25) / count;
    poses.push_back(lookAt(Vector3d(radius_m * std::cos(angle), radius_m * std::sin(angle),
                                    0.4 * std::sin(3.0 * angle)),
                           Vector3d(0.0, 0.0, 0.0), Vector3d::UnitZ()));
  }
  return poses;
}

double distanceOf(const Colour& a, const VertexColour& b) {
  const double red = a[0] - b.red, green = a[1] - b.green, blue = a[2] - b.blue;
  return std::sqrt(red * red + green * green + blue * blue);
}

Mesh meshOf(Mapper& mapper, float voxel_size_m) {
  MeshStore store(voxel_size_m);
  store.apply(mapper.updateMesh());
  return store.assemble();
}

/// Fuses depth and colour frames alternately. @return the mesh.
Mesh paintedPlate(float voxel_size_m, bool directional) {
  const Scene scene = plateScene();
  const auto mapper =
      makeProbedMapper(makeCpuParams(FusionMode::kNormalRayCasting, directional, voxel_size_m));
  for (const Eigen::Isometry3d& T_W_C : orbit(24, 1.0)) {
    mapper->integrate(renderFrame(scene, T_W_C, kWidth, kHeight).view());
    mapper->paint(
        renderColour(scene, plateColour, besideCamera(T_W_C, 0.05), kWidth, kHeight).view());
  }
  return meshOf(*mapper, voxel_size_m);
}

/// The number of vertices on the plate's sides, more than a voxel from its rim, and the fractions
/// of these vertices that have a wrong colour or none.
struct PlateColours {
  size_t vertices = 0;
  double other_side = 0.0, background = 0.0, unpainted = 0.0;
};

PlateColours judgePlate(const Mesh& mesh, double voxel_size_m) {
  PlateColours judged;
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    const Vec3f& p = mesh.vertices_m[i];
    const Vector3d p_W(p.x, p.y, p.z);
    if (std::abs(p_W.x()) > 2.0 * voxel_size_m || !isWithinPlate(p_W, voxel_size_m)) continue;
    ++judged.vertices;
    const bool in_front = mesh.normals[i].x > 0.0f;
    const VertexColour& colour = mesh.colours[i];
    const double own = distanceOf(in_front ? kRed : kBlue, colour);
    if (colour.painted == 0) {
      judged.unpainted += 1.0;
    } else if (distanceOf(in_front ? kBlue : kRed, colour) < own) {
      judged.other_side += 1.0;
    } else if (distanceOf(kGreen, colour) < own) {
      judged.background += 1.0;
    }
  }
  const double share = 1.0 / static_cast<double>(std::max<size_t>(judged.vertices, 1));
  judged.other_side *= share;
  judged.background *= share;
  judged.unpainted *= share;
  return judged;
}

class PaintedPlate : public testing::TestWithParam<float> {};

TEST_P(PaintedPlate, EachSideHasItsOwnColour) {
  const Mesh mesh = paintedPlate(GetParam(), true);
  ASSERT_EQ(mesh.colours.size(), mesh.vertices_m.size());
  const PlateColours judged = judgePlate(mesh, GetParam());
  EXPECT_GT(judged.vertices, 2 * std::pow(0.4 / GetParam(), 2.0));
  EXPECT_LT(judged.other_side, 0.01);
  EXPECT_LT(judged.background, 0.01);
  EXPECT_LT(judged.unpainted, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Voxels, PaintedPlate, testing::Values(0.01f, 0.02f),
                         [](const testing::TestParamInfo<float>& info) {
                           return std::to_string(std::lround(1000.0f * info.param)) + "mm";
                         });

/// In an undirected map, a voxel has one colour for both sides.
TEST(Paint, UndirectedMapMixesTheSides) {
  const PlateColours judged = judgePlate(paintedPlate(0.02f, false), 0.02);
  EXPECT_GT(judged.other_side + judged.background + judged.unpainted, 0.05);
}

/// A wall at y = 1.5 m, to which tests add objects.
Scene wallScene() {
  Scene scene;
  scene.add(Plane{Vector3d(0.0, 1.5, 0.0), Vector3d(0.0, -1.0, 0.0)});
  return scene;
}

Eigen::Isometry3d lookingAtWall(const Vector3d& eye_W) {
  return lookAt(eye_W, eye_W + Vector3d::UnitY(), Vector3d::UnitZ());
}

/// Fuses enough depth images of a scene to get a mesh.
void fuse(Mapper& mapper, const Scene& scene, const Eigen::Isometry3d& T_W_C) {
  const SceneFrame frame = renderFrame(scene, T_W_C);
  for (int i = 0; i < 3; ++i) mapper.integrate(frame.view());
}

std::unique_ptr<ProbedMapper> makeMapperAt(float voxel_size_m, int threads = 2) {
  return makeProbedMapper(
      makeCpuParams(FusionMode::kNormalRayCasting, true, voxel_size_m, threads));
}

PaintedFrame plainFrame(const Colour& colour, const Eigen::Isometry3d& T_W_C) {
  return renderColour(
      wallScene(), [&](const Vector3d&) { return colour; }, T_W_C);
}

struct WallColours {
  size_t painted = 0, unpainted = 0;
  double mean[3] = {};
};

/// Colours of the wall's vertices that `choose` selects.
template <class Choose>
WallColours wallColours(const Mesh& mesh, const Choose& choose) {
  WallColours result;
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    const Vec3f& p = mesh.vertices_m[i];
    if (std::abs(p.y - 1.5f) > 0.05f || !choose(p)) continue;
    const bool painted = i < mesh.colours.size() && mesh.colours[i].painted != 0;
    ++(painted ? result.painted : result.unpainted);
    if (!painted) continue;
    result.mean[0] += mesh.colours[i].red;
    result.mean[1] += mesh.colours[i].green;
    result.mean[2] += mesh.colours[i].blue;
  }
  for (double& channel : result.mean) channel /= std::max<size_t>(result.painted, 1);
  return result;
}

bool anywhere(const Vec3f&) { return true; }

/// A board 0.3 m wide, 0.7 m in front of the wall. The depth camera moves and maps the whole wall.
/// The colour camera stands still, so the board hides part of the wall from it.
TEST(Paint, HiddenSurfacesAreNotPainted) {
  Scene scene = wallScene();
  scene.add(makeBox(Vector3d(0.0, 0.8, 0.0), Vector3d(0.3, 0.02, 2.0)));
  const auto mapper = makeMapperAt(0.02f);
  for (const double x : {-0.6, 0.0, 0.6}) fuse(*mapper, scene, lookingAtWall({x, 0.0, 0.0}));
  const auto colour = [](const Vector3d& p_W) { return p_W.y() < 1.0 ? kRed : kGreen; };
  const PaintedFrame frame =
      renderColour(scene, colour, lookingAtWall(Vector3d::Zero()), kWidth, kHeight);
  ASSERT_EQ(mapper->paint(frame.view()).status, FrameStatus::kFused);
  const Mesh mesh = meshOf(*mapper, 0.02f);
  const double shadow_m = 0.15 * 1.5 / 0.79;  // half the width of the hidden part of the wall
  const WallColours hidden =
      wallColours(mesh, [&](const Vec3f& p) { return std::abs(p.x) < shadow_m - 0.02; });
  EXPECT_GT(hidden.unpainted, 300u);
  EXPECT_EQ(hidden.painted, 0u);
  const WallColours seen = wallColours(mesh, [&](const Vec3f& p) {
    return std::abs(p.x) > shadow_m + 0.08 && std::abs(p.x) < 0.8 && std::abs(p.z) < 0.6;
  });
  EXPECT_GT(seen.painted, 300u);
  EXPECT_EQ(seen.unpainted, 0u);
  EXPECT_NEAR(seen.mean[0], kGreen[0], 0.5);
  EXPECT_NEAR(seen.mean[1], kGreen[1], 0.5);
}

/// The wall keeps its colour while a camera moves along it and changes its exposure and white
/// balance.
TEST(Paint, ExposureChangesLeaveNoPatches) {
  const auto mapper = makeMapperAt(0.02f);
  for (double x = 0.0; x < 2.0; x += 0.5) fuse(*mapper, wallScene(), lookingAtWall({x, 0.0, 0.0}));
  for (int i = 0; i < 9; ++i) {
    const double bright = 1.0 + 0.4 * std::sin(2.0 * i), warm = 1.0 + 0.15 * std::cos(3.0 * i);
    const Colour colour{static_cast<uint8_t>(120 * bright * warm / 1.15),
                        static_cast<uint8_t>(120 * bright), static_cast<uint8_t>(90 * bright)};
    mapper->paint(plainFrame(colour, lookingAtWall({0.2 * i, 0.0, 0.0})).view());
  }
  const Mesh mesh = meshOf(*mapper, 0.02f);
  for (double x = -0.6; x < 2.0; x += 0.2) {
    const WallColours strip = wallColours(
        mesh, [x](const Vec3f& p) { return p.x > x && p.x < x + 0.2 && std::abs(p.z) < 0.5f; });
    ASSERT_GT(strip.painted, 100u) << x;
    EXPECT_NEAR(strip.mean[0], 120.0, 2.0) << x;
    EXPECT_NEAR(strip.mean[1], 120.0, 2.0) << x;
    EXPECT_NEAR(strip.mean[2], 90.0, 2.0) << x;
  }
}

/// Depth and colour images of the demo's room, painted in stripes, from cameras side by side.
struct RoomFrames {
  std::vector<SceneFrame> depth;
  std::vector<PaintedFrame> colour;
};

Colour striped(const Vector3d& p_W) {
  const auto wave = [](double at) {
    return static_cast<uint8_t>(std::lround(128.0 + 100.0 * std::sin(9.0 * at)));
  };
  return {wave(p_W.x()), wave(p_W.y()), wave(p_W.z())};
}

RoomFrames roomFrames(int count) {
  RoomFrames frames;
  const Scene scene = makeRoomScene();
  for (int i = 0; i < count; ++i) {
    const Eigen::Isometry3d T_W_C = roomCameraPose(0.4 * i);
    frames.depth.push_back(renderFrame(scene, T_W_C));
    frames.colour.push_back(renderColour(scene, striped, besideCamera(T_W_C, 0.05)));
  }
  return frames;
}

void feed(Mapper& mapper, const RoomFrames& frames, size_t i) {
  mapper.integrate(frames.depth[i].view());
  mapper.paint(frames.colour[i].view());
}

TEST(Paint, RepeatingAnImageDoesNotChangeTheMesh) {
  const auto mapper = makeMapperAt(0.02f);
  fuse(*mapper, wallScene(), lookingAtWall(Vector3d::Zero()));
  const PaintedFrame frame = plainFrame(kGreen, lookingAtWall({0.1, 0.1, 0.0}));
  mapper->paint(frame.view());
  EXPECT_FALSE(mapper->updateMesh().blocks.empty());
  mapper->paint(frame.view());
  EXPECT_TRUE(mapper->updateMesh().blocks.empty());
}

TEST(Paint, DoesNotChangeTheShape) {
  const RoomFrames frames = roomFrames(4);
  const auto plain = makeMapperAt(0.04f), painted = makeMapperAt(0.04f);
  for (size_t i = 0; i < frames.depth.size(); ++i) {
    plain->integrate(frames.depth[i].view());
    feed(*painted, frames, i);
  }
  Mesh a = meshOf(*plain, 0.04f), b = meshOf(*painted, 0.04f);
  EXPECT_TRUE(a.colours.empty());
  EXPECT_FALSE(b.colours.empty());
  b.colours.clear();
  EXPECT_TRUE(sameMeshes(a, b));
  EXPECT_EQ(plain->stats().colour_bytes, 0u);
}

TEST(Paint, AddsLessThanFortyPercentToTheMap) {
  const RoomFrames frames = roomFrames(12);
  for (const float voxel_size_m : {0.02f, 0.05f}) {
    const auto mapper = makeMapperAt(voxel_size_m);
    for (size_t i = 0; i < frames.depth.size(); ++i) feed(*mapper, frames, i);
    const MapStats stats = mapper->stats();
    const double without = static_cast<double>(stats.map_bytes - stats.colour_bytes);
    EXPECT_GT(stats.colour_bytes, 0u);
    EXPECT_LT(static_cast<double>(stats.map_bytes), 1.4 * without);
  }
}

TEST(Paint, StaysWithinTheBudget) {
  const RoomFrames frames = roomFrames(4);
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.02f);
  const auto plenty = makeProbedMapper(params);
  for (const SceneFrame& frame : frames.depth) plenty->integrate(frame.view());
  params.map.max_memory_mb = static_cast<int>(plenty->stats().map_bytes >> 20);  // just too small
  const auto small = makeProbedMapper(params);
  for (const SceneFrame& frame : frames.depth) small->integrate(frame.view());
  const uint64_t refused_before = small->stats().refused_blocks;
  const IntegrationResult result = small->paint(frames.colour[0].view());
  EXPECT_EQ(result.status, FrameStatus::kFused);
  EXPECT_GT(result.refused_blocks, 0u);
  EXPECT_LE(small->stats().map_bytes, static_cast<size_t>(params.map.max_memory_mb) << 20);
  EXPECT_EQ(small->stats().refused_blocks, refused_before + result.refused_blocks);
}

/// Clearing a surface removes its colour, so a new surface at the same place is unpainted. Here,
/// part of a board is removed and put back.
TEST(Paint, ColourIsRemovedWithTheSurface) {
  Scene whole = wallScene(), part = wallScene();
  whole.add(makeBox(Vector3d(0.0, 1.0, 0.0), Vector3d(0.6, 0.02, 0.6)));
  part.add(makeBox(Vector3d(-0.11, 1.0, 0.0), Vector3d(0.38, 0.02, 0.6)));  // up to x = 0.08
  const auto mapper = makeMapperAt(0.02f);
  const Eigen::Isometry3d T_W_C = lookingAtWall(Vector3d::Zero());
  fuse(*mapper, whole, T_W_C);
  const auto colour = [](const Vector3d& p_W) { return p_W.y() < 1.2 ? kRed : kGrey; };
  const PaintedFrame red = renderColour(whole, colour, T_W_C);
  for (int i = 0; i < 8; ++i) mapper->paint(red.view());
  const size_t painted_bytes = mapper->stats().colour_bytes;
  const SceneFrame without = renderFrame(part, T_W_C);
  for (int i = 0; i < 20; ++i) mapper->integrate(without.view());
  EXPECT_LT(mapper->stats().colour_bytes, painted_bytes);
  fuse(*mapper, whole, T_W_C);
  const Mesh mesh = meshOf(*mapper, 0.02f);
  size_t kept = 0, back = 0;
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    const Vec3f& p = mesh.vertices_m[i];
    if (p.y > 1.1f || std::abs(p.z) > 0.25f || p.x > 0.25f) continue;
    if (p.x < 0.0f) kept += mesh.colours[i].painted != 0;
    if (p.x > 0.12f) {
      ++back;
      EXPECT_EQ(mesh.colours[i].painted, 0) << p.x;
    }
  }
  EXPECT_GT(kept, 100u);
  EXPECT_GT(back, 100u);
}

TEST(Paint, BadImagesAreRefusedAndChangeNothing) {
  const auto mapper = makeMapperAt(0.02f), untouched = makeMapperAt(0.02f);
  for (Mapper* each : {static_cast<Mapper*>(mapper.get()), static_cast<Mapper*>(untouched.get())}) {
    fuse(*each, wallScene(), lookingAtWall(Vector3d::Zero()));
  }
  const PaintedFrame good = plainFrame(kRed, lookingAtWall(Vector3d::Zero()));
  const auto refuses = [&](FrameStatus status, const std::function<void(ColourFrame&)>& spoil) {
    ColourFrame frame = good.view();
    spoil(frame);
    const IntegrationResult result = mapper->paint(frame);
    EXPECT_EQ(result.status, status) << result.message;
    EXPECT_FALSE(result.message.empty());
  };
  refuses(FrameStatus::kBadImage, [](ColourFrame& f) { f.data = nullptr; });
  refuses(FrameStatus::kBadImage, [](ColourFrame& f) { f.width = 0; });
  refuses(FrameStatus::kBadImage, [](ColourFrame& f) { f.row_bytes = 3 * f.width - 1; });
  refuses(FrameStatus::kBadImage, [](ColourFrame& f) { f.encoding = ColourEncoding::kRgba8; });
  refuses(FrameStatus::kBadIntrinsics, [](ColourFrame& f) { f.intrinsics.fx = 0.0f; });
  refuses(FrameStatus::kBadPose, [](ColourFrame& f) { f.T_W_C.linear() *= 2.0; });
  refuses(FrameStatus::kBadPose, [](ColourFrame& f) { f.T_W_C.translation().x() = NAN; });
  refuses(FrameStatus::kNoMeasurement, [](ColourFrame& f) {
    f.T_W_C = lookAt(Vector3d::Zero(), -Vector3d::UnitY(), Vector3d::UnitZ());
  });
  EXPECT_TRUE(sameMaps(*mapper, *untouched));
  EXPECT_EQ(makeMapperAt(0.02f)->paint(good.view()).status, FrameStatus::kNoMeasurement);
}

/// Uniform images in every encoding, in colour and in grey, all with padded rows.
TEST(Paint, ReadsEveryEncoding) {
  const PaintedFrame rgb = plainFrame({200, 100, 50}, lookingAtWall(Vector3d::Zero()));
  const auto colours = [&](ColourEncoding encoding, const std::vector<uint8_t>& pixel) {
    ColourFrame frame = rgb.frame;
    std::vector<uint8_t> bytes;
    for (int v = 0; v < frame.height; ++v) {
      for (int u = 0; u < frame.width; ++u) bytes.insert(bytes.end(), pixel.begin(), pixel.end());
      bytes.insert(bytes.end(), 5, 255);
    }
    frame.data = bytes.data();
    frame.encoding = encoding;
    frame.row_bytes = frame.width * pixel.size() + 5;
    const auto mapper = makeMapperAt(0.04f);
    fuse(*mapper, wallScene(), lookingAtWall(Vector3d::Zero()));
    EXPECT_EQ(mapper->paint(frame).status, FrameStatus::kFused);
    const WallColours wall = wallColours(meshOf(*mapper, 0.04f), anywhere);
    EXPECT_GT(wall.painted, 100u);
    return std::vector<double>(wall.mean, wall.mean + 3);
  };
  const std::vector<double> expected{200.0, 100.0, 50.0};
  EXPECT_EQ(colours(ColourEncoding::kRgb8, {200, 100, 50}), expected);
  EXPECT_EQ(colours(ColourEncoding::kBgr8, {50, 100, 200}), expected);
  EXPECT_EQ(colours(ColourEncoding::kRgba8, {200, 100, 50, 7}), expected);
  EXPECT_EQ(colours(ColourEncoding::kBgra8, {50, 100, 200, 7}), expected);
  EXPECT_EQ(colours(ColourEncoding::kMono8, {90}), (std::vector<double>{90.0, 90.0, 90.0}));
}

}  // namespace
}  // namespace dtsdf
