// Tests finding the pose of a camera in a map from an image alone, without a prior pose.
#include "dtsdf_mapping/place_search.h"

#include <gtest/gtest.h>

#include <memory>

#include "support/furnished_room.h"
#include "support/pose_distance.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

std::unique_ptr<Session> mapOf(const Scene& scene) {
  auto session =
      std::make_unique<Session>(makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f));
  for (const Isometry3d& T_W_C : viewsAround()) {
    session->integrate(renderFrame(scene, T_W_C));
  }
  return session;
}

FoundPlace find(Session& map, const SceneFrame& image, int threads = 2) {
  DepthFrame frame = image.view();
  frame.T_W_C = Isometry3d::Identity();
  return findPlace(map.mapper(), frame, threads);
}

/// One camera is rolled by 2.5 rad, since the search does not know which way is up.
TEST(PlaceSearch, FindsACameraFromItsImageAlone) {
  const Scene scene = roomWithFurniture();
  const auto map = mapOf(scene);
  Isometry3d rolled = cameraTowards({-0.6, 0.3, 1.5}, 0.2);
  rolled.rotate(Eigen::AngleAxisd(2.5, Vector3d::UnitZ()));
  for (const Isometry3d& truth :
       {cameraTowards({-0.5, 0.4, 1.4}, -0.3), cameraTowards({0.4, -0.5, 1.0}, 2.9), rolled}) {
    const FoundPlace found = find(*map, renderFrame(scene, truth, 64, 48));
    ASSERT_EQ(found.alignment.status, AlignmentStatus::kAligned) << found.explained_share;
    EXPECT_LT(shiftBetween_m(found.alignment.T_W_C, truth), 0.02);
    EXPECT_LT(turnBetween_rad(found.alignment.T_W_C, truth), 0.02);
    EXPECT_GT(found.explained_share, 0.9);
    EXPECT_FALSE(found.other_T_W_C);
  }
}

TEST(PlaceSearch, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = roomWithFurniture();
  const auto map = mapOf(scene);
  const SceneFrame image = renderFrame(scene, cameraTowards({-0.5, 0.4, 1.4}, -0.3), 64, 48);
  const FoundPlace one = find(*map, image, 1), three = find(*map, image, 3);
  EXPECT_EQ(one.alignment.T_W_C.matrix(), three.alignment.T_W_C.matrix());
  EXPECT_EQ(one.explained_share, three.explained_share);
}

/// In an empty rectangular room, diagonally opposite corners look alike.
TEST(PlaceSearch, ReportsAmbiguityIfPlacesLookAlike) {
  const Scene scene = emptyRoom();
  const auto map = mapOf(scene);
  const Isometry3d truth = cameraTowards({0.3, 0.2, 1.3}, 0.6);
  const FoundPlace found = find(*map, renderFrame(scene, truth, 64, 48));
  ASSERT_EQ(found.alignment.status, AlignmentStatus::kAmbiguous);
  ASSERT_TRUE(found.other_T_W_C);
  EXPECT_GT(turnBetween_rad(*found.other_T_W_C, found.alignment.T_W_C), 1.0);
}

TEST(PlaceSearch, DoesNotFindUnmappedPlaces) {
  const auto map = mapOf(roomWithFurniture());
  Scene elsewhere;
  for (int i = 0; i < 12; ++i) {
    for (int k = 0; k < 8; ++k) elsewhere.add(Sphere{{1.5, 0.3 * i - 1.6, 0.3 * k}, 0.13});
  }
  const SceneFrame image = renderFrame(elsewhere, cameraTowards({-0.5, 0.0, 1.2}, 0.0), 64, 48);
  EXPECT_NE(find(*map, image).alignment.status, AlignmentStatus::kAligned);
}

TEST(PlaceSearch, NeedsAMapAndMeasurements) {
  Session empty(makeCpuParams());
  const SceneFrame image = renderFrame(emptyRoom(), cameraTowards({0.0, 0.0, 1.2}, 0.0), 64, 48);
  EXPECT_EQ(find(empty, image).alignment.status, AlignmentStatus::kUnmapped);
  const auto map = mapOf(emptyRoom());
  const SceneFrame nothing = renderFrame(Scene(), Isometry3d::Identity(), 64, 48);
  EXPECT_EQ(find(*map, nothing).alignment.status, AlignmentStatus::kUnmapped);
  EXPECT_EQ(findPlace(map->mapper(), DepthFrame(), 1).alignment.status, AlignmentStatus::kUnmapped);
}

}  // namespace
}  // namespace dtsdf
