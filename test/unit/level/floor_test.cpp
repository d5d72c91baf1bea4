// Tests that the floor is found in the first images of scenes whose floor is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "level/floor.h"
#include "level/level_pose.h"
#include "simulation/scene.h"
#include "support/depth_frames.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = 0.017453292519943295;

/// T_M_R. R is the room's frame (z up, floor at z = 0); M is the frame of the input poses.
Eigen::Isometry3d tilted(double tilt_deg, const Vector3d& axis, const Vector3d& shift_m) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(tilt_deg * kDegree, axis.normalized()).toRotationMatrix();
  T.translation() = shift_m;
  return T;
}

/// The first images of a lap through the room, with poses in M.
std::vector<SceneFrame> lapFrames(const Eigen::Isometry3d& T_M_R,
                                  size_t count = FloorSearch::kViews, double from_s = 0.0) {
  std::vector<SceneFrame> frames;
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Isometry3d T_R_C = roomCameraPose(from_s + 0.1 * static_cast<double>(i));
    frames.push_back(renderFrame(makeRoomScene(), T_R_C));
    frames.back().frame.T_W_C = T_M_R * T_R_C;
  }
  return frames;
}

/// Searches all frames for one common floor.
FloorSearch searched(const std::vector<SceneFrame>& frames) {
  FloorSearch search;
  for (const SceneFrame& frame : frames) search.add(frame.view());
  search.finish();
  return search;
}

/// Checks that levelling aligns the room's z axis with the z axis of W and puts the floor at z = 0.
void expectLevel(const FloorPlane& floor, const Eigen::Isometry3d& T_M_R, double max_deg,
                 double max_m) {
  const Eigen::Isometry3d T_W_R = levelPose(floor.normal(), -floor.offset()) * T_M_R;
  const Vector3d up_W = T_W_R.linear().col(2);
  EXPECT_LT(std::atan2(std::hypot(up_W.x(), up_W.y()), up_W.z()) / kDegree, max_deg);
  for (const double x : {-2.5, 2.5}) {
    for (const double y : {-2.0, 2.0}) {
      EXPECT_NEAR((T_W_R * Vector3d(x, y, 0.0)).z(), 0.0, max_m + 2.5 * max_deg * kDegree);
    }
  }
  EXPECT_NEAR((T_W_R * Vector3d::Zero()).z(), 0.0, max_m);
}

TEST(Floor, IsFoundExactlyInATiltedRoom) {
  const Eigen::Isometry3d frames[] = {
      tilted(0.0, Vector3d::UnitX(), Vector3d::Zero()),
      tilted(25.0, Vector3d(1.0, 2.0, 0.0), Vector3d(3.0, -1.0, 7.0)),
      tilted(90.0, Vector3d::UnitX(), Vector3d(0.0, 1.0, 0.0)),
      tilted(180.0, Vector3d::UnitY(), Vector3d(0.0, 0.0, -2.0)),
      roomCameraPose(0.0).inverse(),  // M is the first camera's frame
  };
  for (const Eigen::Isometry3d& T_M_R : frames) {
    const FloorSearch search = searched(lapFrames(T_M_R));
    ASSERT_TRUE(search.floor()) << search.problem();
    expectLevel(*search.floor(), T_M_R, 0.1, 0.001);
  }
}

TEST(Floor, IsFoundDespiteNoise) {
  const Eigen::Isometry3d T_M_R = tilted(40.0, Vector3d(0.0, 1.0, 0.0), Vector3d(0.0, 2.0, 0.0));
  std::vector<SceneFrame> frames = lapFrames(T_M_R);
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  for (SceneFrame& frame : frames) {
    for (float& z : frame.depth_m) z += 0.0015f * z * z * normal(random);
  }
  const FloorSearch search = searched(frames);
  ASSERT_TRUE(search.floor()) << search.problem();
  expectLevel(*search.floor(), T_M_R, 0.3, 0.005);
}

/// Searches images of a stationary camera in a scene with z up.
FloorSearch searchResultFrom(const Scene& scene, const Vector3d& eye, const Vector3d& target,
                             const Vector3d& up = Vector3d::UnitZ()) {
  return searched(
      std::vector<SceneFrame>(FloorSearch::kViews, renderFrame(scene, lookAt(eye, target, up))));
}

TEST(Floor, IsFoundNextToALargeTable) {
  Scene scene;
  scene.add(Plane{Vector3d::Zero(), Vector3d::UnitZ()});
  scene.add(makeBox(Vector3d(1.6, 0.0, 0.4), Vector3d(1.6, 1.0, 0.8)));  // fills most of the image
  scene.add(makeBox(Vector3d(4.0, 0.0, 1.5), Vector3d(0.2, 8.0, 3.0)));
  const FloorSearch search =
      searchResultFrom(scene, Vector3d(0.0, 0.0, 1.5), Vector3d(2.0, 0.0, 0.6));
  ASSERT_TRUE(search.floor()) << search.problem();
  expectLevel(*search.floor(), Eigen::Isometry3d::Identity(), 0.1, 0.001);
}

TEST(Floor, IsNeitherWallNorCeilingNorStrip) {
  Scene wall;
  wall.add(Plane{Vector3d(2.0, 0.0, 0.0), -Vector3d::UnitX()});
  for (const double pitch : {-0.5, 0.0, 0.5}) {
    const FloorSearch search =
        searchResultFrom(wall, Vector3d(0.0, 0.0, 1.0), Vector3d(2.0, 0.0, 1.0 + 2.0 * pitch));
    EXPECT_FALSE(search.floor()) << pitch;
    EXPECT_FALSE(search.problem().empty());
  }
  Scene ceiling;
  ceiling.add(Room{Vector3d(-3.0, -3.0, -100.0), Vector3d(3.0, 3.0, 2.5)});
  EXPECT_FALSE(searchResultFrom(ceiling, Vector3d(0.0, 0.0, 1.5), Vector3d(2.0, 0.0, 2.2)).floor());
  Scene beam;  // too narrow for determining the tilt
  beam.add(Plane{Vector3d(1.5, 0.0, 0.0), -Vector3d::UnitX()});
  beam.add(makeBox(Vector3d(1.4, 0.0, 0.5), Vector3d(0.2, 8.0, 0.2)));
  EXPECT_FALSE(searchResultFrom(beam, Vector3d(0.0, 0.0, 1.0), Vector3d(1.5, 0.0, 0.6)).floor());
}

/// The points measured by a camera 1 m above the floor: `on_floor` points on a floor `width_m`
/// wide, and `on_wall` points on a wall behind it.
FloorView viewOfStrip(double width_m, int on_floor, int on_wall) {
  FloorView view{Vector3d(0.0, 0.0, 1.0), Vector3d::UnitZ(), {}};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int i = 0; i < on_floor; ++i) {
    view.points.push_back(
        {Vector3d(1.0 + 2.0 * share(random), width_m * share(random), 0.0), 0.01});
  }
  for (int i = 0; i < on_wall; ++i) {
    view.points.push_back({Vector3d(3.0, 4.0 * share(random), 3.0 * share(random)), 0.01});
  }
  return view;
}

TEST(Floor, MustBeWideAndLargeEnough) {
  std::string problem;
  EXPECT_TRUE(fitFloor({viewOfStrip(1.0, 400, 2000)}, problem));
  const auto problemOf = [&](const std::vector<FloorView>& views) {
    EXPECT_FALSE(fitFloor(views, problem));
    return problem;
  };
  EXPECT_NE(problemOf({viewOfStrip(0.05, 400, 2000)}).find("only a strip"), std::string::npos)
      << problemOf({viewOfStrip(0.05, 400, 2000)});
  EXPECT_NE(problemOf({viewOfStrip(1.0, 400, 12000)}).find("a twentieth"), std::string::npos);
  EXPECT_NE(problemOf({viewOfStrip(1.0, 60, 0)}).find("hardly any depth"), std::string::npos);
  FloorView down = viewOfStrip(1.0, 400, 2000);
  down.camera_up *= -1.0;
  EXPECT_NE(problemOf({viewOfStrip(1.0, 400, 2000), down}).find("turns too much"),
            std::string::npos);
  problemOf({});
}

TEST(Floor, NeedsAnUprightCamera) {
  const Vector3d eye(-2.0, 0.0, 1.4), target(0.0, 0.5, 0.6);
  EXPECT_TRUE(searchResultFrom(makeRoomScene(), eye, target, Vector3d(0.0, 0.4, 1.0)).floor());
  const FloorSearch portrait =
      searchResultFrom(makeRoomScene(), eye, target, Vector3d(0.0, 1.0, 0.0));
  if (portrait.floor()) {  // another plane, not the floor
    EXPECT_LT(portrait.floor()->normal().z(), 0.8);
  }
}

TEST(FloorSearch, SearchesUntilAFloorIsFound) {
  Scene wall;
  wall.add(Plane{Vector3d(2.0, 0.0, 0.0), -Vector3d::UnitX()});
  const SceneFrame no_floor = renderFrame(
      wall, lookAt(Vector3d(0.0, 0.0, 1.0), Vector3d(2.0, 0.0, 1.0), Vector3d::UnitZ()));
  const std::vector<SceneFrame> floor = lapFrames(Eigen::Isometry3d::Identity());
  FloorSearch search;
  for (size_t i = 0; i < FloorSearch::kViews; ++i) {
    EXPECT_TRUE(search.problem().empty());
    EXPECT_EQ(search.add(no_floor.view()), i + 1 == FloorSearch::kViews);
  }
  EXPECT_FALSE(search.problem().empty());
  EXPECT_FALSE(search.floor());
  for (const SceneFrame& frame : floor) search.add(frame.view());
  EXPECT_TRUE(search.floor());
  EXPECT_TRUE(search.problem().empty());
  const FloorPlane found = *search.floor();
  for (size_t i = 0; i < FloorSearch::kViews; ++i) EXPECT_FALSE(search.add(no_floor.view()));
  EXPECT_EQ(search.floor()->offset(), found.offset()) << "the first floor found should be kept";
}

TEST(FloorSearch, SkipsUnusableImages) {
  const std::vector<SceneFrame> floor = lapFrames(Eigen::Isometry3d::Identity());
  SceneFrame empty = floor.front(), lost = floor.front();
  std::fill(empty.depth_m.begin(), empty.depth_m.end(), 0.0f);
  lost.frame.T_W_C.translation().x() = std::nan("");
  DepthFrame no_data = floor.front().frame;
  no_data.data = nullptr;
  FloorSearch search;
  for (size_t i = 0; i < 2 * FloorSearch::kViews; ++i) {
    EXPECT_FALSE(search.add(empty.view()));
    EXPECT_FALSE(search.add(lost.view()));
    EXPECT_FALSE(search.add(no_data));
  }
  search.finish();
  EXPECT_FALSE(search.floor());
  EXPECT_FALSE(search.problem().empty());
}

TEST(LevelPose, IsTheSmallestRotation) {
  EXPECT_TRUE(levelPose(Vector3d::UnitZ()).isApprox(Eigen::Isometry3d::Identity()));
  const Eigen::Isometry3d of_optical = levelPose(-Vector3d::UnitY(), 0.5);
  EXPECT_TRUE((of_optical.linear() * Vector3d::UnitX()).isApprox(Vector3d::UnitX()));
  EXPECT_TRUE((of_optical.linear() * Vector3d::UnitZ()).isApprox(Vector3d::UnitY()));
  EXPECT_NEAR((of_optical * Vector3d(0.0, -0.5, 0.0)).z(), 0.0, 1e-12);
  EXPECT_NEAR(tiltOf(of_optical), 90.0, 1e-9);
  const Eigen::Isometry3d of_ned = levelPose(-Vector3d::UnitZ());
  EXPECT_TRUE((of_ned.linear() * -Vector3d::UnitZ()).isApprox(Vector3d::UnitZ()));
  EXPECT_NEAR(of_ned.linear().determinant(), 1.0, 1e-12);
  const Vector3d up = Vector3d(0.3, -0.2, 0.9).normalized();
  EXPECT_NEAR(Eigen::AngleAxisd(levelPose(up).linear()).angle(), std::acos(up.z()), 1e-12);
}

}  // namespace
}  // namespace dtsdf
