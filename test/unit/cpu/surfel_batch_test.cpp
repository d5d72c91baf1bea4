// Surfels side by side, against one after the other.
#include "cpu/surfel_batch.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace dtsdf {
namespace {

FrameView turnedFrame() {
  FrameView frame{};
  frame.width = 64;
  frame.height = 48;
  frame.intrinsics = {50.0f, 52.0f, 31.0f, 23.5f};
  frame.T_L_C = {{0.8f, 0.0f, 0.6f, 0.0f, 1.0f, 0.0f, -0.6f, 0.0f, 0.8f}, {9.0f, -4.0f, 7.0f}};
  frame.voxel_size_m = 0.02f;
  return frame;
}

/// Some without a normal, some that face away, whose weight is 0.
SeenSurfel randomSurfel(std::mt19937& random) {
  std::uniform_real_distribution<float> share(0.01f, 1.0f), at(-1.0f, 1.0f);
  const Vec3f normal{at(random), at(random), at(random)};
  const float length = random() % 9 == 0 ? 0.0f : 1.0f / norm(normal);
  return {{64.0f * share(random), 48.0f * share(random), 3.0f * share(random)},
          length * normal,
          share(random),
          {share(random), share(random)}};
}

/// As many as fill no batch, one, and several and a part of one.
TEST(SurfelBatch, MakesThoseOfOneAtATime) {
  const FrameView frame = turnedFrame();
  std::mt19937 random(31);
  SurfelBatch batch;
  for (const int count : {0, 3, 64, 321}) {
    std::vector<Surfel> made, expected;
    for (int i = 0; i < count; ++i) {
      const SeenSurfel seen = randomSurfel(random);
      batch.add(frame, seen, made);
      const Surfel surfel = makeSurfel(frame, seen);
      if (surfel.weight > 0.0f) expected.push_back(surfel);
    }
    batch.finish(frame, made);
    ASSERT_EQ(made.size(), expected.size());
    EXPECT_EQ(0, std::memcmp(made.data(), expected.data(), made.size() * sizeof(Surfel)));
    EXPECT_LT(static_cast<int>(made.size()), count == 0 ? 1 : count);
  }
}

}  // namespace
}  // namespace dtsdf
