// Tests maps of analytic scenes in all fusion modes: the distance of the mesh from the true
// surface, and its topology. Lengths are in voxels unless their names end in another unit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "kernels/core/vec.h"
#include "support/depth_frames.h"
#include "support/mesh_topology.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr float kSceneVoxel_m = 0.02f;

struct Bounds {
  double rms, max;
};

using Mode = std::tuple<FusionMode, bool>;

class AnalyticScenes : public testing::TestWithParam<Mode> {
 protected:
  FusionMode mode() const { return std::get<0>(GetParam()); }
  bool directional() const { return std::get<1>(GetParam()); }
  bool projective() const { return mode() == FusionMode::kVoxelProjection; }
  MapperParams params() const { return makeCpuParams(mode(), directional(), kSceneVoxel_m); }
};

void expectWithin(const SurfaceError& error, const Bounds& bounds) {
  EXPECT_LT(error.rms_m / kSceneVoxel_m, bounds.rms) << error.vertices << " vertices";
  EXPECT_LT(error.max_m / kSceneVoxel_m, bounds.max) << error.vertices << " vertices";
}

/// Checks properties of every valid mesh, with or without holes.
void expectValidMesh(const Mesh& mesh) {
  const MeshTopology topology = measureTopology(mesh);
  EXPECT_GT(topology.triangles, 1000u);
  EXPECT_EQ(topology.repeated_corners, 0u) << topology;
  EXPECT_EQ(topology.zero_areas, 0u) << topology;
  EXPECT_EQ(topology.unused_vertices, 0u) << topology;
  EXPECT_EQ(topology.coincident_vertices, 0u) << topology;
  for (const Vec3f& n : mesh.normals) ASSERT_NEAR(norm(n), 1.0f, 1e-4f);
}

/// Checks that vertex normals point into free space. Tiny triangles at a border may have any
/// orientation, since vertices there are moved to measured points, which are rounded.
void expectNormalsFaceFreeSpace(const Mesh& mesh, const Scene& scene) {
  size_t wrong = 0;
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    const Vec3f &p = mesh.vertices_m[i], &n = mesh.normals[i];
    const Vector3d at(p.x, p.y, p.z), normal(n.x, n.y, n.z);
    const double step = 0.25 * kSceneVoxel_m;
    wrong += scene.signedDistance(at + step * normal) <= scene.signedDistance(at - step * normal);
  }
  EXPECT_LE(wrong, mesh.vertices_m.size() / 5000) << "of " << mesh.vertices_m.size();
}

/// Six views of a tilted plane, up to 1.6 m away. Point-to-plane distances are exact except for
/// rounding. A directional map also rounds the measured points to which it moves vertices at the
/// border of the surface. Projective distances are off by up to half a pixel's step in depth, which
/// is 8 mm for pixels 6 mm wide and a plane inclined by 60 degrees. The limits also allow for
/// interpolation errors.
TEST_P(AnalyticScenes, TiltedPlane) {
  Scene scene;
  scene.add(Plane{Vector3d(0.1, 0.05, 0.02), Vector3d(0.3, -0.4, 1.0).normalized()});
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 6; ++i) {
    poses.push_back(lookAt(Vector3d(0.4 * std::cos(i), 0.4 * std::sin(i), 1.2),
                           Vector3d(0.1 * std::sin(2 * i), 0.1 * std::cos(i), 0.0),
                           Vector3d(0.2, 1.0, 0.1)));
  }
  MapperParams settings = params();
  settings.fusion.max_depth_m = 1.6f;
  const Mesh mesh = reconstruct(settings, renderFrames(scene, poses));
  const Bounds rounding = directional() ? Bounds{0.003, 0.087} : Bounds{0.001, 0.01};
  expectWithin(measureError(mesh, scene), projective() ? Bounds{0.15, 0.5} : rounding);
  expectValidMesh(mesh);
  expectNormalsFaceFreeSpace(mesh, scene);
}

/// A ball with a radius R of 20 voxels, viewed from all sides. At a distance r from the point of
/// contact, a tangent plane is off by r^2 / (2 R). This is 0.05 at sqrt(2) voxels, where the weight
/// has fallen to 0. Projective distances grow without bound where rays graze the ball. The
/// undirected map uses no normals, so it cannot lower the weights of grazing views.
TEST_P(AnalyticScenes, Ball) {
  const Vector3d centre(0.13, -0.07, 0.21);
  Scene scene;
  scene.add(Sphere{centre, 0.4});
  const Mesh mesh = reconstruct(params(), renderFrames(scene, sphereOfPoses(centre, 1.1, 24)));
  expectWithin(measureError(mesh, scene), projective() ? Bounds{0.15, 0.75} : Bounds{0.02, 0.05});
  expectValidMesh(mesh);
  expectNormalsFaceFreeSpace(mesh, scene);
}

/// A box rotated relative to the grid. Its faces are flat, except within one and a half truncation
/// distances of an edge, where projective distances from other views distort them.
TEST_P(AnalyticScenes, FacesOfARotatedBox) {
  const Vector3d centre(0.1, 0.02, 0.03);
  Scene scene;
  scene.add(makeBox(centre, Vector3d(0.5, 0.4, 0.6), 0.4));
  const Mesh mesh = reconstruct(params(), renderFrames(scene, sphereOfPoses(centre, 1.2, 24)));
  expectValidMesh(mesh);
  const Eigen::Matrix3d R_B_W = Eigen::AngleAxisd(-0.4, Vector3d::UnitZ()).toRotationMatrix();
  double worst = 0.0;
  size_t on_faces = 0;
  for (const Vec3f& p : mesh.vertices_m) {
    Vector3d inside =
        Vector3d(0.25, 0.2, 0.3) - (R_B_W * (Vector3d(p.x, p.y, p.z) - centre)).cwiseAbs();
    std::sort(inside.data(), inside.data() + 3);
    if (inside[1] < 6.0 * kSceneVoxel_m) continue;  // close to another face
    worst = std::max(worst, std::abs(inside[0]) / kSceneVoxel_m);
    ++on_faces;
  }
  EXPECT_GT(on_faces, 1000u);
  EXPECT_LT(worst, projective() ? 0.5 : 0.01);
}

double areaWithin(const Mesh& mesh, const Eigen::AlignedBox3d& box) {
  double area = 0.0;
  for (const auto& triangle : mesh.triangles) {
    Vector3d corner[3];
    for (int i = 0; i < 3; ++i) {
      const Vec3f& p = mesh.vertices_m[triangle[i]];
      corner[i] = Vector3d(p.x, p.y, p.z);
    }
    const Vector3d centre = (corner[0] + corner[1] + corner[2]) / 3.0;
    if (!box.contains(centre)) continue;
    area += 0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]).norm();
  }
  return area;
}

/// A floor in a single image, 0.15 m below the camera and 2 to 2.7 m ahead. On the floor, pixels
/// are 4 to 5 mm wide but 53 to 97 mm (3 to 5 voxels) long. If they were not subdivided, they would
/// leave holes.
TEST(GrazingView, LeavesNoHolesInAFloor) {
  Scene scene;
  scene.add(Plane{Vector3d::Zero(), Vector3d::UnitZ()});
  const auto T_W_C =
      lookAt(Vector3d(0.013, 0.007, 0.15), Vector3d(2.5, 0.0, 0.1), Vector3d::UnitZ());
  MapperParams params = makeCpuParams();
  params.fusion.max_depth_m = 3.5f;
  const Mesh mesh = reconstruct(params, renderFrames(scene, {T_W_C}, 640, 480));
  const Eigen::AlignedBox3d part(Vector3d(2.0, -0.4, -0.1), Vector3d(2.7, 0.4, 0.1));
  EXPECT_NEAR(areaWithin(mesh, part), 0.56, 0.02);
}

/// A wall in one image, with pixels narrower or wider than a voxel. There must be no holes due to
/// wide pixels or to the empty lines of registered depth images.
TEST(Wall, HasNoHolesAtAnyPixelWidth) {
  Scene scene;
  scene.add(Plane{Vector3d(2.0, 0.0, 0.0), Vector3d(-1.0, 0.3, 0.1).normalized()});
  const auto T_W_C = lookAt(Vector3d::Zero(), Vector3d(2.0, 0.0, 0.0), Vector3d::UnitZ());
  const Eigen::AlignedBox3d part(Vector3d(0.0, -0.4, -0.3), Vector3d(4.0, 0.4, 0.3));
  const double whole_m2 = 0.8 * 0.6 * std::sqrt(1.0 + 0.3 * 0.3 + 0.1 * 0.1);
  for (const int width : {80, 120, 144, 160, 192, 240, 320}) {  // pixels 1.6 to 0.4 voxels wide
    std::vector<SceneFrame> frames = renderFrames(scene, {T_W_C}, width, width * 3 / 4);
    const Mesh mesh = reconstruct(makeCpuParams(), frames);
    EXPECT_NEAR(areaWithin(mesh, part), whole_m2, 0.01 * whole_m2) << width;
    for (int v = 0; v < frames[0].frame.height; ++v) {
      for (int u = 0; u < width; ++u) {
        if (u % 3 == 1 || v % 4 == 2) frames[0].depth_m[v * width + u] = 0.0f;
      }
    }
    const Mesh of_pieces = reconstruct(makeCpuParams(), frames);
    EXPECT_NEAR(areaWithin(of_pieces, part), whole_m2, 0.01 * whole_m2) << width;
    EXPECT_LT(measureError(of_pieces, scene).max_m, 0.05 * kSceneVoxel_m) << width;
  }
}

/// A wire one pixel wide, in front of a wall.
TEST(ThinWire, IsMappedFromOneColumnOfPixels) {
  const double wire_m = 0.008;
  Scene scene;
  scene.add(makeBox(Vector3d(1.5, 0.006, 0.0), Vector3d(wire_m, wire_m, 1.0), 0.0));
  scene.add(Plane{Vector3d(2.5, 0.0, 0.0), -Vector3d::UnitX()});
  const auto T_W_C = lookAt(Vector3d(0.0, 0.0, 0.0), Vector3d(1.5, 0.0, 0.0), Vector3d::UnitZ());
  const std::vector<SceneFrame> frames = renderFrames(scene, {T_W_C});
  const auto& depth_m = frames[0].depth_m;
  const auto hits = std::count_if(depth_m.begin(), depth_m.end(), [](float z) { return z < 2; });
  ASSERT_GT(hits, 60);
  ASSERT_LT(hits, 120);  // the number of rows
  const Mesh mesh = reconstruct(makeCpuParams(), frames);
  const Eigen::AlignedBox3d around(Vector3d(1.4, -0.05, -0.25), Vector3d(1.6, 0.05, 0.25));
  // In the mesh, the wire is narrower, since vertices are moved to its measured points.
  EXPECT_GT(areaWithin(mesh, around), 0.4 * wire_m);
  EXPECT_LT(measureError(mesh, scene).max_m, 1.5 * kSceneVoxel_m);
}

INSTANTIATE_TEST_SUITE_P(All, AnalyticScenes,
                         testing::Combine(testing::Values(FusionMode::kVoxelProjection,
                                                          FusionMode::kRayCasting,
                                                          FusionMode::kNormalRayCasting),
                                          testing::Bool()),
                         [](const testing::TestParamInfo<Mode>& info) {
                           return modeName(std::get<0>(info.param), std::get<1>(info.param));
                         });

/// The mesh of a ball viewed from all sides is closed and consistently oriented. If a surface needs
/// support from only one frame, 24 views are enough. If it needs support from two, twice as many
/// views are needed, because view rays miss some samples.
class ClosedBall : public testing::TestWithParam<Mode> {};

TEST_P(ClosedBall, HasNoBoundary) {
  const auto [mode, directional] = GetParam();
  const Vector3d centre(0.13, -0.07, 0.21);
  Scene scene;
  scene.add(Sphere{centre, 0.4});
  MapperParams params = makeCpuParams(mode, directional, kSceneVoxel_m);
  for (const int min_support : {1, 2}) {
    params.mesh.min_support = min_support;
    const Mesh mesh =
        reconstruct(params, renderFrames(scene, sphereOfPoses(centre, 1.1, 24 * min_support)));
    const MeshTopology topology = measureTopology(mesh);
    EXPECT_TRUE(topology.isClosedManifold()) << topology << ", support " << min_support;
    // Euler: V - E + F = 2 for one closed surface without handles, and 3 F = 2 E.
    EXPECT_EQ(mesh.vertices_m.size() - mesh.triangles.size() / 2, 2u);
  }
}

/// Casting along view rays into the directional map is not tested, since the mesh then lacks some
/// triangles, however many views there are.
INSTANTIATE_TEST_SUITE_P(Modes, ClosedBall,
                         testing::Values(Mode{FusionMode::kVoxelProjection, true},
                                         Mode{FusionMode::kVoxelProjection, false},
                                         Mode{FusionMode::kRayCasting, false},
                                         Mode{FusionMode::kNormalRayCasting, true},
                                         Mode{FusionMode::kNormalRayCasting, false}),
                         [](const testing::TestParamInfo<Mode>& info) {
                           return modeName(std::get<0>(info.param), std::get<1>(info.param));
                         });

}  // namespace
}  // namespace dtsdf
