#include "evaluation/moving_object.h"

#include <gtest/gtest.h>

#include "evaluation/shared_options.h"
#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

MovingObject objectOf(MovingObject::Shape shape, const Vector3d& size_m, const Vector3d& from_W,
                      const Vector3d& to_W) {
  MovingObject object;
  object.shape = shape;
  object.size_m = size_m;
  object.from_W = from_W;
  object.to_W = to_W;
  return object;
}

const MovingObject kBox =
    objectOf(MovingObject::Shape::kBox, {0.2, 0.4, 0.6}, {0, 0, 0}, {1, 0, 0});
const MovingObject kBall =
    objectOf(MovingObject::Shape::kBall, {0.2, 0.2, 0.2}, {0, 0, 0}, {1, 0, 0});

TEST(MovingObject, MovesFromOneEndToTheOther) {
  EXPECT_EQ(kBox.centreAt(0.0), Vector3d(0, 0, 0));
  EXPECT_EQ(kBox.centreAt(0.25), Vector3d(0.25, 0, 0));
  EXPECT_EQ(objectShapeFromName("ball"), MovingObject::Shape::kBall);
  EXPECT_THROW(objectShapeFromName("cone"), std::invalid_argument);
}

TEST(MovingObject, RaysMeetItsFront) {
  const Vector3d centre(0, 0, 2), forward(0, 0, 1);
  EXPECT_NEAR(intersect(kBox, centre, {0, 0, 0}, forward).value(), 1.7, 1e-12);
  EXPECT_NEAR(intersect(kBox, centre, {0.09, 0.19, 0}, forward).value(), 1.7, 1e-12);
  EXPECT_NEAR(intersect(kBox, centre, {0, 0, 0}, 2.0 * forward).value(), 0.85, 1e-12);
  EXPECT_NEAR(intersect(kBall, centre, {0, 0, 0}, forward).value(), 1.9, 1e-12);
  EXPECT_NEAR(intersect(kBall, centre, {0.06, 0, 0}, forward).value(), 1.92, 1e-12) << "3, 4, 5";
}

TEST(MovingObject, RaysMissItOrBeginInside) {
  const Vector3d centre(0, 0, 2), forward(0, 0, 1);
  EXPECT_FALSE(intersect(kBox, centre, {0.11, 0, 0}, forward));
  EXPECT_FALSE(intersect(kBox, centre, {0, 0.21, 0}, forward));
  EXPECT_FALSE(intersect(kBall, centre, {0.08, 0.08, 0}, forward));
  EXPECT_FALSE(intersect(kBox, centre, {0, 0, 0}, -forward)) << "behind";
  EXPECT_FALSE(intersect(kBox, centre, centre, forward)) << "inside";
}

TEST(MovingObject, SweepsWhatItPassesThrough) {
  EXPECT_TRUE(sweeps(kBox, {0.5, 0.19, 0.29}, 0.0));
  EXPECT_TRUE(sweeps(kBox, {-0.09, 0, 0}, 0.0));
  EXPECT_TRUE(sweeps(kBox, {1.09, 0, 0}, 0.0));
  EXPECT_FALSE(sweeps(kBox, {1.11, 0, 0}, 0.0));
  EXPECT_FALSE(sweeps(kBox, {0.5, 0.21, 0}, 0.0));
  EXPECT_TRUE(sweeps(kBox, {0.5, 0.21, 0}, 0.02));
  const MovingObject aslant =
      objectOf(MovingObject::Shape::kBox, {0.2, 0.2, 0.2}, {0, 0, 0}, {1, 1, 0});
  EXPECT_TRUE(sweeps(aslant, {0.5, 0.6, 0}, 0.0));
  EXPECT_FALSE(sweeps(aslant, {0.2, 0.8, 0}, 0.0)) << "within the bounds of its way, beside it";
  const MovingObject still =
      objectOf(MovingObject::Shape::kBox, {0.2, 0.2, 0.2}, {1, 1, 1}, {1, 1, 1});
  EXPECT_TRUE(sweeps(still, {1.09, 1, 1}, 0.0));
  EXPECT_FALSE(sweeps(still, {1.11, 1, 1}, 0.0));
}

/// A row of seven pixels 0.1 m apart at 1.7 m, where the box's front is: three of them hit it.
TEST(MovingObject, IsPutBeforeWhatIsFartherOrNotMeasured) {
  const ViewCamera camera{{17, 17, 3, 0}, 7, 1};
  std::vector<float> depth_m{3, 3, 1.5f, 0, 3, 3, 0};
  const MovingObject wide =
      objectOf(MovingObject::Shape::kBox, {0.3, 0.4, 0.6}, {0, 0, 2}, {0, 0, 2});
  const size_t shown =
      composite(wide, wide.centreAt(0.0), camera, Eigen::Isometry3d::Identity(), depth_m);
  EXPECT_EQ(shown, 2u) << "one of the three has something nearer";
  EXPECT_EQ(depth_m, (std::vector<float>{3, 3, 1.5f, 1.7f, 1.7f, 3, 0}));
}

/// The camera is turned to look along x, from 1 m before the origin.
TEST(MovingObject, IsSeenFromThePose) {
  const ViewCamera camera{{100, 100, 0, 0}, 1, 1};
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T_W_C.translation() = Vector3d(-1, 0, 0);
  std::vector<float> depth_m{0};
  EXPECT_EQ(composite(kBox, {0, 0, 0}, camera, T_W_C, depth_m), 1u);
  EXPECT_NEAR(depth_m[0], 0.9f, 1e-6f);
}

/// A box of 0.2 m that moves by 0.4 m passes through 0.6 x 0.2 m of a wall. The wall without it is
/// there for x < 0: 0.25 m of the way are farther than 0.05 m from that.
TEST(MovingObject, TheTrailIsWhatTheReferenceHasNot) {
  const MovingObject object =
      objectOf(MovingObject::Shape::kBox, {0.2, 0.2, 0.2}, {-0.2, 0, 0}, {0.2, 0, 0});
  const Trail trail = findTrail(makeRectangle(-1, -1, 1, 1, 0), makeRectangle(-5, -5, 0, 5, 0),
                                object, {0.0, 0.05, 400000});
  EXPECT_NEAR(trail.sample_m2, 4.0 / 400000, 1e-9);
  EXPECT_NEAR(trail.sample_m2 * static_cast<double>(trail.swept), 0.12, 0.003);
  EXPECT_NEAR(trail.sample_m2 * static_cast<double>(trail.points.size()), 0.05, 0.002);
  for (const auto& p_W : trail.points) EXPECT_GT(p_W.x(), 0.05f);
}

/// A camera at (0, 0, -1) with three pixels, of which the middle one measured 2 m, one nothing.
TEST(MovingObject, ImagesSeeThroughWhatIsFarBeforeTheirDepth) {
  const ViewCamera camera{{10, 10, 1, 0}, 3, 1};
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.translation() = Vector3d(0, 0, -1);
  const std::vector<float> depth_m{3, 2, 0};
  const auto sees = [&](double x, double z) {
    return seesThrough(depth_m, camera, T_W_C, {x, 0, z}, 0.05);
  };
  EXPECT_TRUE(sees(0.0, 0.94));
  EXPECT_FALSE(sees(0.0, 0.96)) << "beside the surface";
  EXPECT_FALSE(sees(0.0, 1.5)) << "behind it";
  EXPECT_TRUE(sees(-0.1, 0.0)) << "by the pixel to the left";
  EXPECT_FALSE(sees(0.1, 0.0)) << "nothing measured";
  EXPECT_FALSE(sees(0.2, 0.0)) << "beside the image";
  EXPECT_FALSE(sees(0.0, -2.0)) << "behind the camera";
}

TEST(ViewSelection, TakesFirstToLastByStep) {
  FrameSelection frames;
  frames.first = 1;
  frames.last = 7;
  frames.step = 3;
  EXPECT_EQ(selectViews(frames, 100), (std::vector<size_t>{1, 4, 7}));
  EXPECT_EQ(selectViews(frames, 5), (std::vector<size_t>{1, 4}));
  EXPECT_THROW(selectViews(frames, 1), UsageError);
}

}  // namespace
}  // namespace dtsdf
