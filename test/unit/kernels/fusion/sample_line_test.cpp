// Compares the samples along a surfel's line with values computed from their definition for every
// voxel around the surfel.
#include "kernels/fusion/sample_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include "kernels/fusion/cast.h"
#include "support/random_vectors.h"

namespace dtsdf {
namespace sample_line_test {

using VoxelId = std::tuple<int, int, int>;

VoxelId idOf(const Vec3i& v) { return {v.x, v.y, v.z}; }

struct LineSample {
  float share, distance;
};

struct Cast {
  Vec3f p, normal, direction;
  float truncation;
};

/// A cast along the normal or along a slanted ray; every tenth cast starts exactly at a grid point.
Cast randomCast(std::mt19937& random, int i) {
  std::uniform_real_distribution<float> uniform(-20.0f, 20.0f);
  Cast cast{{uniform(random), uniform(random), uniform(random)}, randomUnit(random), {}, 4.0f};
  if (i % 10 == 0) {
    cast.p = {std::floor(cast.p.x), std::floor(cast.p.y), std::floor(cast.p.z)};
    cast.normal = {0.0f, i % 20 == 0 ? 1.0f : -1.0f, 0.0f};
  }
  cast.direction = cast.normal;
  if (i % 2 == 1) {
    do {
      cast.direction = randomUnit(random);
    } while (dot(cast.direction, cast.normal) > -0.1f);
  }
  if (i % 5 == 0) cast.truncation = 1.0f;
  return cast;
}

std::map<VoxelId, LineSample> samplesOf(const SampleLine& line) {
  std::map<VoxelId, LineSample> samples;
  for (int plane = line.first_plane; plane <= line.last_plane; ++plane) {
    const CellCrossing crossing = crossCell(line, plane);
    for (int corner = 0; corner < 4; ++corner) {
      const int du = corner & 1, dv = corner >> 1;
      const CornerSample at =
          sampleCorner<false>(line, noSides(), pointShifts(line.axis), crossing, du, dv);
      if (!(at.share > 0.0f)) continue;
      const Vec3i voxel = unpermute(line.axis, plane, crossing.u + du, crossing.v + dv);
      const LineSample sample{at.share, at.distance};
      EXPECT_TRUE(samples.emplace(idOf(voxel), sample).second)
          << "visited twice: " << voxel.x << " " << voxel.y << " " << voxel.z;
    }
  }
  return samples;
}

/// The expected fraction of the surfel's weight at a voxel. It is the squared bilinear weight where
/// the line crosses the voxel's grid plane normal to the dominant axis, times a factor that falls
/// linearly with the distance from the measured plane.
double expectedShare(const Cast& cast, const Vec3i& voxel) {
  const double d[3] = {cast.direction.x, cast.direction.y, cast.direction.z};
  const double offset[3] = {voxel.x - double(cast.p.x), voxel.y - double(cast.p.y),
                            voxel.z - double(cast.p.z)};
  int k = 0;
  for (int axis = 1; axis < 3; ++axis) k = std::abs(d[axis]) > std::abs(d[k]) ? axis : k;
  const double reach = std::min(cast.truncation, FusionRules().sample_reach);
  const double along = offset[k] / d[k];
  if (std::abs(along) > reach) return 0.0;
  double share = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == k) continue;
    const double apart = std::abs(offset[axis] - along * d[axis]);
    share *= std::max(0.0, 1.0 - apart);
  }
  const double distance =
      offset[0] * cast.normal.x + offset[1] * cast.normal.y + offset[2] * cast.normal.z;
  return share * share * std::max(0.0, 1.0 - std::abs(distance) / reach);
}

SampleLine lineOf(const Cast& cast) {
  return makeSampleLine(cast.p, cast.normal, cast.direction,
                        sampleReach(0.0f, {1, 1, cast.truncation, 64.0f, FusionRules()}));
}

TEST(SampleLine, VisitsEachSampleOnceWithItsShareAndDistance) {
  std::mt19937 random(14);
  for (int i = 0; i < 500; ++i) {
    SCOPED_TRACE("cast " + std::to_string(i));
    const Cast cast = randomCast(random, i);
    const std::map<VoxelId, LineSample> samples = samplesOf(lineOf(cast));
    const Vec3i centre{floorToInt(cast.p.x), floorToInt(cast.p.y), floorToInt(cast.p.z)};
    size_t found = 0;
    for (int z = -4; z <= 5; ++z) {
      for (int y = -4; y <= 5; ++y) {
        for (int x = -4; x <= 5; ++x) {
          const Vec3i voxel = centre + Vec3i{x, y, z};
          const double share = expectedShare(cast, voxel);
          const auto it = samples.find(idOf(voxel));
          found += it != samples.end();
          EXPECT_NEAR(it == samples.end() ? 0.0 : it->second.share, share, 2e-4);
          if (it == samples.end()) continue;
          const Vec3f offset = toFloat(voxel) - cast.p;
          EXPECT_NEAR(it->second.distance, dot(offset, cast.normal), 2e-5);
        }
      }
    }
    EXPECT_EQ(found, samples.size()) << "all samples should be near the point";
  }
}

}  // namespace sample_line_test
}  // namespace dtsdf
