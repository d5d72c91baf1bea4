// Tests which points are known to be free in depth images of analytic surfaces and in images
// defined pixel by pixel.
#include "kernels/fusion/free_space.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "support/random_vectors.h"
#include "support/surface_image.h"

namespace dtsdf {
namespace free_space_test {

constexpr int kWidth = 64, kHeight = 48;
constexpr Intrinsics kIntrinsics{100.0f, 100.0f, 31.5f, 23.5f};
constexpr float kVoxel_m = 0.02f, kTruncation = 4.0f;
const SurfelSettings kSurfels{5, 0.1f, SurfelRules(), 0};
const FusionSettings kFusion{1, 1, kTruncation, 64.0f, FusionRules()};

/// A depth image of a surface, and the depth up to which each pixel's ray is free.
class FreeSpaceImage {
 public:
  explicit FreeSpaceImage(const Surface& surface, float sigma = 0.0f)
      : image_(surface, frontalFrame(kWidth, kHeight, kIntrinsics, kVoxel_m), kSurfels, sigma) {
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const Pixel pixel{i % kWidth, i / kWidth};
      free_depth_.push_back(freeDepth(image_.sensing(), pixel, kFusion));
    }
  }

  float freeDepthAt(int u, int v) const { return free_depth_[v * kWidth + u]; }
  FrameSensing sensing() const {
    FrameSensing sensing = image_.sensing();
    sensing.free_depth = free_depth_.data();
    return sensing;
  }

 private:
  SurfaceImage image_;
  std::vector<float> free_depth_;
};

/// A ray is free up to a margin before the surface. The margin is half a voxel plus three standard
/// deviations, measured along the normal of the plane.
TEST(FreeDepth, EndsAMarginBeforeThePlane) {
  for (const float sigma : {0.0f, 0.005f}) {
    for (const auto& n :
         {Vec3f{0, 0, 1}, Vec3f{0.6f, 0, 0.8f}, Vec3f{0, -0.8f, 0.6f}, Vec3f{0.48f, 0.64f, 0.6f}}) {
      const double delta = 1.2;
      const FreeSpaceImage image(plane(n.x, n.y, n.z, delta), sigma);
      for (int v = 8; v < kHeight - 8; ++v) {
        for (int u = 8; u < kWidth - 8; ++u) {
          const float free_m = image.freeDepthAt(u, v);
          const double x = (u - 31.5) / 100.0, y = (v - 23.5) / 100.0;
          const double depth_m = delta / (n.x * x + n.y * y + n.z);
          if (!(depth_m > 0.0 && depth_m < 4.0)) continue;
          const Vec3f p =
              backProject(kIntrinsics, static_cast<float>(u), static_cast<float>(v), free_m);
          const double margin = 0.5 + 3.0 * sigma * depth_m * depth_m / kVoxel_m;
          EXPECT_NEAR((delta - dot(n, p)) / kVoxel_m, margin, 0.02) << u << ", " << v;
        }
      }
    }
  }
}

/// One pixel measures 12 m, the other measures nothing. A negative inverse depth marks a
/// measurement beyond the fusion range. Without a plane, the margin is measured along the ray.
TEST(FreeDepth, ReachesBeyondTheFusionRange) {
  const float row[] = {0.0f, 0.0f};
  const PixelLinks links[] = {0, 0};
  for (const float sigma : {0.0f, 0.001f}) {
    const float inverse_depth[] = {-1.0f / 12.0f, 0.0f};
    const FrameSensing sensing{
        {frontalFrame(2, 1, kIntrinsics, kVoxel_m), inverse_depth, row, row, links},
        {sigma, 0},
        nullptr};
    EXPECT_NEAR(freeDepth(sensing, {0, 0}, kFusion), 12.0f - 0.01f - 432.0f * sigma, 1e-4f);
    EXPECT_EQ(freeDepth(sensing, {1, 0}, kFusion), 0.0f);
  }
}

/// The camera is 5 mm from the plane, less than the margin of 10 mm, so nothing is free.
TEST(FreeDepth, IsZeroWithinTheMargin) {
  const FreeSpaceImage image(plane(0, 1, 0, 0.005));
  for (const int v : {40, 43, 46}) EXPECT_EQ(image.freeDepthAt(30, v), 0.0f);
}

/// The voxels of a block for one of the six directions.
struct Array {
  Voxel voxel[kVoxelsPerBlock] = {};

  Array() = default;
  explicit Array(const std::function<double(const Vec3f&)>& sdf) {
    for (int i = 0; i < kVoxelsPerBlock; ++i) set(i, static_cast<float>(sdf(at(i))));
  }
  static Vec3f at(int index) { return toFloat(voxelOffset(index)); }
  void set(int index, float sdf) { voxel[index] = makeVoxel(sdf, 1 << 16, 3); }
  Voxel& operator()(int x, int y, int z) { return voxel[voxelIndex(x, y, z)]; }
  Vec3f foot(int x, int y, int z, int direction) const {
    return placeOf(voxel, voxelIndex(x, y, z), direction, false);
  }
};

/// The largest tested distance from the plane. Voxels can store distances up to 16.
constexpr float kFarthest = 12.0f;

void expectNear(const Vec3f& a, const Vec3f& b) {
  EXPECT_LT(norm(a - b), 8e-3f) << a.x << " " << a.y << " " << a.z << ", not " << b.x << " " << b.y
                                << " " << b.z;
}

/// A voxel's foot is the base of the perpendicular from the voxel to the plane. It is found in each
/// direction in which the plane is stored, even at the block's corners.
TEST(Foot, LiesOnThePerpendicular) {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> offset(-3.0, 12.0);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3f n = randomUnit(random);
    const double d = offset(random);
    const Array array([&](const Vec3f& p) { return dot(n, p) - d; });
    const DirectionSet directions = directionsOf(n, true);
    for (int k = 0; k < directions.count; ++k) {
      for (int i = 0; i < kVoxelsPerBlock; i += 7) {
        if (std::abs(sdfOf(array.voxel[i])) > kFarthest) continue;
        const Vec3f foot = placeOf(array.voxel, i, directions.direction[k], false);
        expectNear(foot, Array::at(i) - sdfOf(array.voxel[i]) * n);
      }
    }
  }
}

/// One measured neighbour per axis is enough to find the foot. Without any neighbours, the foot is
/// sought along the axis of the direction.
TEST(Foot, ToleratesMissingNeighbours) {
  Array array([](const Vec3f& p) { return 0.6 * p.x + 0.8 * p.y - 6.0; });
  const Vec3f foot{3.6f, 4.8f, 4.0f};  // 1.8 + 3.2 - 6 = -1 at (3, 4)
  expectNear(array.foot(3, 4, 4, 2), foot);
  for (const Vec3i& gone : {Vec3i{4, 4, 4}, Vec3i{3, 5, 4}, Vec3i{3, 4, 5}}) {
    array(gone.x, gone.y, gone.z) = makeVoxel(0.0f, 0, 0);
    expectNear(array.foot(3, 4, 4, 2), foot);
  }
  Array lonely;
  lonely.set(voxelIndex(3, 4, 5), -1.5f);
  expectNear(lonely.foot(3, 4, 5, 0), {4.5f, 4, 5});
  expectNear(lonely.foot(3, 4, 5, 1), {1.5f, 4, 5});
  expectNear(lonely.foot(3, 4, 5, 5), {3, 4, 3.5f});
}

/// A 9 x 9 image in which every pixel is free up to 2 m. A point straight ahead at 1 m projects to
/// the centre pixel.
class SeesThrough : public testing::Test {
 protected:
  bool sees(const Vec3f& p_L, const Voxel& voxel = makeVoxel(0.0f, 1 << 16, 3)) const {
    return observation(p_L, voxel) == Observation::kFree;
  }
  Observation observation(const Vec3f& p_L,
                          const Voxel& voxel = makeVoxel(0.0f, 1 << 16, 3)) const {
    const FrameView frame = frontalFrame(9, 9, {10.0f, 10.0f, 4.0f, 4.0f}, kVoxel);
    const FrameSensing sensing{
        {frame, nullptr, nullptr, nullptr, nullptr}, {0.0f, 0}, free_.data()};
    return judge(sensing, voxel, projectToImage(frame, p_L));
  }
  float& at(int u, int v) { return free_[static_cast<size_t>(9 * v + u)]; }

  static constexpr float kVoxel = 0.1f;
  std::vector<float> free_ = std::vector<float>(81, 2.0f);
  const Vec3f ahead_{0, 0, 10};
};

TEST_F(SeesThrough, EndsAtTheFreeDepth) {
  EXPECT_TRUE(sees(ahead_));
  EXPECT_TRUE(sees({0, 0, 19.9f}));
  EXPECT_FALSE(sees({0, 0, 20}));
  EXPECT_FALSE(sees({0, 0, -10}));
  EXPECT_FALSE(sees({0, 0, 0}));
}

/// A point is not known to be free if one of the 3 x 3 pixels around it is nearer or unmeasured.
/// Other pixels do not matter.
TEST_F(SeesThrough, NeedsFreeNeighbourPixels) {
  for (int i = 0; i < 81; ++i) {
    const int u = i % 9, v = i / 9;
    for (const float free_m : {0.0f, 0.9f, 1.0f}) {
      at(u, v) = free_m;
      EXPECT_EQ(sees(ahead_), std::abs(u - 4) > 1 || std::abs(v - 4) > 1) << u << ", " << v;
    }
    at(u, v) = 2.0f;
  }
}

/// A point at an object's outline counts as outside the object if the point's own pixel is free,
/// even if the object is visible in a neighbouring pixel.
TEST_F(SeesThrough, OwnPixelDecidesAtAnOutline) {
  for (int v = 0; v < 9; ++v) {
    for (int u = 0; u < 4; ++u) at(u, v) = 0.9f;
  }
  const auto observationAt = [&](int u) {
    return observation({1.0f * static_cast<float>(u - 4), 0, 10});
  };
  EXPECT_EQ(observationAt(3), Observation::kOccupied);
  EXPECT_EQ(observationAt(4), Observation::kAtOutline);
  EXPECT_EQ(observationAt(5), Observation::kFree);
}

constexpr int kZMinus = 5;
/// Counts the voxels of block (0, 0, 6) that the image contradicts.
size_t contradicted(const FreeSpaceImage& image, const Array& array) {
  size_t count = 0;
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    count +=
        judge(image.sensing(), {0, 0, 48}, array.voxel, i, kZMinus, false) == Observation::kFree;
  }
  return count;
}
/// A wall in this block, at 51.2 voxels (1.024 m).
const Array kWall([](const Vec3f& p) { return 3.2 - p.z; });

/// Voxels on both sides of the wall represent the same surface, so an image contradicts all of them
/// or none. An image of a wall at 1.05 m contradicts even the voxels beyond 1.05 m.
TEST(Judge, BothSidesOfAWallAreJudgedAlike) {
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 3.0)), kWall), 512u);
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 1.05)), kWall), 512u);
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 1.037)), kWall), 512u);  // 13 mm off
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 1.031)), kWall), 0u);    // 7 mm off
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 1.024)), kWall), 0u);
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 0.5)), kWall), 0u);  // hidden
}

/// An empty voxel is contradicted if it and the next voxel along the ray are free. An image of a
/// wall at 1.04 m shows free space up to 1.03 m, so the layers at 0.96, 0.98 and 1.00 m count.
TEST(Judge, EmptyVoxelsAreJudgedAtTheirPosition) {
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 3.0)), Array()), 512u);
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 1.04)), Array()), 3u * 64u);
  EXPECT_EQ(contradicted(FreeSpaceImage(plane(0, 0, 1, 0.9)), Array()), 0u);
}

/// A voxel that the frame covers is tested at its anchor (a measured point), others at their feet.
TEST(Judge, CoveredVoxelsAreJudgedByTheirAnchors) {
  Array wall = kWall;
  Voxel& voxel = wall(3, 3, 3);
  voxel.anchor = packAnchor({0.0f, 0.0f, 0.75f}, 0.5f);  // at 51.75 voxels, 1.035 m
  const auto isContradicted = [&](double wall_m, bool is_covered) {
    return judge(FreeSpaceImage(plane(0, 0, 1, wall_m)).sensing(), {0, 0, 48}, wall.voxel,
                 voxelIndex(3, 3, 3), kZMinus, is_covered) == Observation::kFree;
  };
  EXPECT_TRUE(isContradicted(1.04, false));  // the foot is at 1.024 m
  EXPECT_FALSE(isContradicted(1.04, true));
  EXPECT_TRUE(isContradicted(1.05, true));
}

/// A camera with a random orientation, and a principal point in or near the image.
FrameView randomFrame(std::mt19937& random) {
  std::uniform_real_distribution<float> centre(-40.0f, 100.0f), focal(20.0f, 400.0f),
      offset(-8.0f, 8.0f);
  FrameView frame = frontalFrame(
      kWidth, kHeight, {focal(random), focal(random), centre(random), centre(random)}, kVoxel_m);
  const Vec3f z = randomUnit(random), a = cross(z, randomUnit(random)), x = (1.0f / norm(a)) * a;
  const Vec3f y = cross(z, x);
  frame.T_L_C = {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z},
                 {offset(random), offset(random), offset(random)}};
  return frame;
}

/// Each voxel is up to 16 voxels away from its foot, the greatest distance that a voxel can store.
/// Two thirds of the feet are at the border of the image.
TEST(MayBeInView, NeverMissesAFootInTheImage) {
  std::mt19937 random(32);
  std::uniform_real_distribution<float> share(0.0f, 1.0f);
  int in_image = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    const FrameView frame = randomFrame(random);
    const float depth_m = trial % 2 ? 0.02f + 0.3f * share(random) : 4.0f * share(random);
    float u = share(random) * kWidth - 0.5f, v = share(random) * kHeight - 0.5f;
    if (trial % 3 == 0) u = trial % 2 ? -0.499f : kWidth - 0.501f;
    if (trial % 3 == 1) v = trial % 4 < 2 ? -0.499f : kHeight - 0.501f;
    const Vec3f p_C = backProject(frame.intrinsics, u, v, depth_m);
    const Vec3f at_L = transform(frame.T_L_C, (1.0f / kVoxel_m) * p_C);
    const Vec3f away = 16.0f * std::sqrt(share(random)) * randomUnit(random);
    const Vec3f from = at_L + away;
    const Vec3i voxel{floorToInt(from.x), floorToInt(from.y), floorToInt(from.z)};
    const VoxelInImage at = projectToImage(frame, toFloat(voxel) - away);
    const bool is_seen =
        at.depth_m > 0.0f && at.u >= 0.0f && at.v >= 0.0f && at.u < kWidth && at.v < kHeight;
    if (!is_seen) continue;
    ++in_image;
    ASSERT_TRUE(mayBeInView(frame, blockOfVoxel(voxel)))
        << "trial " << trial << ", pixel " << at.u << " " << at.v << ", depth " << at.depth_m
        << ", distance " << norm(away);
  }
  EXPECT_GT(in_image, 30000);
}

/// At a distance of 100 voxels, the image is 64 voxels wide, so blocks about 90 voxels off the
/// optical axis are rejected.
TEST(MayBeInView, RejectsBlocksFarOutside) {
  const FrameView frame = frontalFrame(kWidth, kHeight, kIntrinsics, kVoxel_m);
  EXPECT_TRUE(mayBeInView(frame, {0, 0, 12}));
  EXPECT_TRUE(mayBeInView(frame, {0, 0, 1000}));
  EXPECT_FALSE(mayBeInView(frame, {0, 0, -5}));
  for (const int beside : {-12, 11}) {
    EXPECT_FALSE(mayBeInView(frame, {beside, 0, 12})) << beside;
    EXPECT_FALSE(mayBeInView(frame, {0, beside, 12})) << beside;
  }
}

}  // namespace free_space_test
}  // namespace dtsdf
