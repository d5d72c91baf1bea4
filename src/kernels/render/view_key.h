/// A pixel of a view in one number: depth in its upper half, what is seen there in its lower one.
///
/// The least of all numbers that are drawn into a pixel is its nearest surface, in whatever order
/// they come. Surfaces at the very same depth are told apart by what they show, so the result does
/// not depend on which block or triangle was drawn first.
#pragma once

#include <cstring>

#include "kernels/colour/vertex_colour.h"
#include "kernels/core/select.h"
#include "kernels/core/vec.h"

namespace dtsdf {

using ViewKey = uint64_t;

/// Nothing was drawn; behind all that is.
constexpr ViewKey kNothingSeen = ~ViewKey{0};

/// Depths are above 0: as numbers and as integers they have one order.
DTSDF_HD uint32_t depthBits(float depth) {
  uint32_t bits;
  memcpy(&bits, &depth, sizeof(bits));
  return bits;
}

DTSDF_HD ViewKey viewKey(float depth, uint32_t shown) {
  return static_cast<ViewKey>(depthBits(depth)) << 32 | shown;
}

/// Whether something at a depth may be seen before a key.
DTSDF_HD bool mayBeBefore(float depth, ViewKey key) {
  return depthBits(depth) <= static_cast<uint32_t>(key >> 32);
}

/// In voxels along the optical axis; 0: no surface.
DTSDF_HD float depthOf(ViewKey key) {
  const uint32_t bits = key == kNothingSeen ? 0u : static_cast<uint32_t>(key >> 32);
  float depth;
  memcpy(&depth, &bits, sizeof(depth));
  return depth;
}

/// Normals are kept as places on an octahedron, unfolded into a square of 65536 x 65536.
constexpr float kNormalSteps = 65535.0f;

DTSDF_HD float signOf(float a) { return select(a < 0.0f, -1.0f, 1.0f); }

/// Of a vector of any length; without one it is taken to face the camera.
DTSDF_HD uint32_t packNormal(const Vec3f& normal_C) {
  const float length = fabsf(normal_C.x) + fabsf(normal_C.y) + fabsf(normal_C.z);
  float x = 0.0f, y = 0.0f;
  if (length > 0.0f) {
    x = normal_C.x / length;
    y = normal_C.y / length;
    if (normal_C.z > 0.0f) {
      const float folded = (1.0f - fabsf(y)) * signOf(x);
      y = (1.0f - fabsf(x)) * signOf(y);
      x = folded;
    }
  }
  const auto step = [](float at) {
    return static_cast<uint32_t>((0.5f * at + 0.5f) * kNormalSteps + 0.5f);
  };
  return step(x) << 16 | step(y);
}

/// Of length one. Without branches, which cost more than all it computes.
DTSDF_HD Vec3f unpackNormal(uint32_t packed) {
  const auto place = [](uint32_t step) {
    return static_cast<float>(static_cast<int32_t>(step)) * (2.0f / kNormalSteps) - 1.0f;
  };
  const float x = place(packed >> 16), y = place(packed & 0xffffu);
  const float z = fabsf(x) + fabsf(y) - 1.0f;
  const Vec3f normal{select(z > 0.0f, (1.0f - fabsf(y)) * signOf(x), x),
                     select(z > 0.0f, (1.0f - fabsf(x)) * signOf(y), y), z};
  return (1.0f / norm(normal)) * normal;
}

DTSDF_HD uint32_t packColour(const VertexColour& colour) {
  return static_cast<uint32_t>(colour.red) << 24 | static_cast<uint32_t>(colour.green) << 16 |
         static_cast<uint32_t>(colour.blue) << 8 | colour.painted;
}

DTSDF_HD VertexColour unpackColour(uint32_t packed) {
  return {static_cast<uint8_t>(packed >> 24), static_cast<uint8_t>(packed >> 16),
          static_cast<uint8_t>(packed >> 8), static_cast<uint8_t>(packed)};
}

/// What a key shows; 0 of nothing.
DTSDF_HD Vec3f normalOf(ViewKey key) {
  const Vec3f normal = unpackNormal(static_cast<uint32_t>(key));
  return select(key == kNothingSeen, 0.0f, 1.0f) * normal;
}
DTSDF_HD VertexColour colourOf(ViewKey key) {
  return unpackColour(key == kNothingSeen ? 0u : static_cast<uint32_t>(key));
}

}  // namespace dtsdf
