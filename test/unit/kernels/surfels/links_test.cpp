// Tests which neighbouring pixels are linked at steps, on steep sides and at mixed pixels. The
// expected links were derived by hand.
#include "kernels/surfels/links.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/links_of_image.h"

namespace dtsdf {
namespace links_test {

constexpr float kFocal = 500.0f;

/// Whether each pixel of the middle row is linked to its right neighbour. With `down`, the image is
/// transposed, and pixels are linked to the neighbour below.
std::vector<bool> linksAlong(const std::vector<std::vector<float>>& rows, float sigma = 0.0f,
                             int32_t in_depth = 0, bool down = false, float voxel_m = 0.0f) {
  const int length = static_cast<int>(rows[0].size()), lines = static_cast<int>(rows.size());
  FrameView frame{};
  frame.width = down ? lines : length;
  frame.height = down ? length : lines;
  frame.intrinsics.fx = kFocal;
  frame.voxel_size_m = voxel_m;
  std::vector<float> image(static_cast<size_t>(length) * lines);
  for (int line = 0; line < lines; ++line) {
    for (int i = 0; i < length; ++i) {
      image[down ? i * lines + line : line * length + i] = rows[line][i];
    }
  }
  const SurfelSettings surfels{5, 0.03f, SurfelRules(), in_depth};
  const std::vector<PixelLinks> links = linksOfImage(frame, image, {sigma, in_depth}, surfels);
  std::vector<bool> linked;
  for (int i = 0; i < length; ++i) {
    const int at = down ? i * lines + lines / 2 : lines / 2 * length + i;
    linked.push_back((links[at] & (down ? kLinkDown : kLinkRight)) != 0);
  }
  return linked;
}

using Links = std::vector<bool>;

/// Pixels are linked across steps of up to a voxel. A voxel of this size exceeds rounding errors,
/// but none of the steps below.
constexpr float kSmallVoxel_m = 0.002f;
Links linksWithSmallVoxels(const std::vector<std::vector<float>>& rows, bool down = false) {
  return linksAlong(rows, 0.0f, 0, down, kSmallVoxel_m);
}

/// A step of 0.02 1/m is less than 3 sqrt(2) times a noise of 0.005 1/m. For time of flight, noise
/// of 5 mm in depth is only 0.00125 1/m at 2 m.
TEST(Links, StepsWithinNoiseAreLinked) {
  const std::vector<float> step{0.5f, 0.5f, 0.48f, 0.48f};
  EXPECT_EQ(linksAlong({step}), Links({true, false, true, false}));
  EXPECT_EQ(linksAlong({step}, 0.005f), Links({true, true, true, false}));
  EXPECT_EQ(linksAlong({step}, 0.005f, 1), Links({true, false, true, false}));
  EXPECT_EQ(linksAlong({step}, 0.02f, 1), Links({true, true, true, false}));
}

/// Equal steps of 0.05 1/m in all rows form one surface, however steep they are. The steps at its
/// ends are less than half as large, so the surface's plane does not predict them.
TEST(Links, SteepSidesAreOneSurface) {
  for (const float nearest : {1.0f, 0.05f}) {  // also at 20 m
    std::vector<float> side{1.0f, 1.0f, 0.98f, 0.93f, 0.88f, 0.87f, 0.87f};
    for (float& inverse_depth : side) inverse_depth *= nearest;
    for (const bool down : {false, true}) {
      EXPECT_EQ(linksWithSmallVoxels({side, side, side}, down),
                Links({true, false, true, true, false, true, false}))
          << nearest;
    }
  }
}

/// The pixels of a steep side are not linked if the row above or below has different depths.
TEST(Links, SteepSidesMustMatchAdjacentRows) {
  const std::vector<float> side{1.0f, 1.0f, 0.98f, 0.93f, 0.88f, 0.87f, 0.87f};
  const std::vector<float> other{1.0f, 1.0f, 0.99f, 0.90f, 0.875f, 0.87f, 0.87f};
  const Links unlinked_side{true, false, false, false, false, true, false};
  EXPECT_EQ(linksWithSmallVoxels({other, side, side}), unlinked_side);
  EXPECT_EQ(linksWithSmallVoxels({side, side, other}), unlinked_side);
}

/// A depth between two surfaces is linked to neither, unless it is halfway between them in all
/// three rows.
TEST(Links, MixedPixelsBelongToNeitherSide) {
  const auto row = [](float mixed) { return std::vector<float>{1, 1, mixed, 0.8f, 0.8f}; };
  EXPECT_EQ(linksWithSmallVoxels({row(0.95f), row(0.87f), row(0.82f)}),
            Links({true, false, false, true, false}));
  EXPECT_EQ(linksWithSmallVoxels({row(0.95f), row(0.9f), row(0.82f)}),
            Links({true, false, false, true, false}));
  EXPECT_EQ(linksWithSmallVoxels({row(0.9f), row(0.9f), row(0.9f)}),
            Links({true, true, true, true, false}));
}

/// The background is empty, too far to be fused, or farther behind the surface than ten times the
/// surface's last step.
TEST(Links, LastStepOfCurvedSurfacesIsLinked) {
  for (const float behind : {0.0f, -0.2f, 0.77f}) {
    for (const bool down : {false, true}) {
      EXPECT_EQ(linksAlong({{1.0f, 1.0f, 0.98f, behind, behind}}, 0.0f, 0, down),
                Links({true, true, false, behind > 0.0f, false}))
          << behind;
      EXPECT_EQ(linksAlong({{behind, behind, 0.98f, 1.0f, 1.0f}}, 0.0f, 0, down),
                Links({behind > 0.0f, false, true, true, false}))
          << behind;
    }
  }
}

}  // namespace links_test
}  // namespace dtsdf
