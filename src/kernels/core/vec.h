/// Small vectors for the rules. They are plain structs, since nvcc emits many warnings about Eigen.
#pragma once

#include <cmath>
#include <cstdint>

#include "dtsdf_mapping/geometry.h"
#include "kernels/core/host_device.h"

namespace dtsdf {

DTSDF_HD Vec3f operator+(const Vec3f& a, const Vec3f& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
DTSDF_HD Vec3f operator-(const Vec3f& a, const Vec3f& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
DTSDF_HD Vec3f operator*(float s, const Vec3f& a) { return {s * a.x, s * a.y, s * a.z}; }
DTSDF_HD Vec3f cross(const Vec3f& a, const Vec3f& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

DTSDF_HD float dot(const Vec3f& a, const Vec3f& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
DTSDF_HD float norm(const Vec3f& a) { return sqrtf(dot(a, a)); }

DTSDF_HD Vec3i operator+(const Vec3i& a, const Vec3i& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
DTSDF_HD Vec3i operator-(const Vec3i& a, const Vec3i& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
DTSDF_HD bool operator==(const Vec3i& a, const Vec3i& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}
DTSDF_HD bool operator!=(const Vec3i& a, const Vec3i& b) { return !(a == b); }

/// Component by axis (0 = x, 1 = y, 2 = z), without an indexed memory access.
DTSDF_HD float component(const Vec3f& a, int axis) {
  return axis == 0 ? a.x : (axis == 1 ? a.y : a.z);
}
DTSDF_HD int32_t component(const Vec3i& a, int axis) {
  return axis == 0 ? a.x : (axis == 1 ? a.y : a.z);
}

DTSDF_HD Vec3f toFloat(const Vec3i& a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

/// Unlike fminf() and fmaxf(), these never become library calls. The arguments must not be NaN.
DTSDF_HD float minimum(float a, float b) { return a < b ? a : b; }
DTSDF_HD float maximum(float a, float b) { return a > b ? a : b; }

/// Component-wise minimum and maximum. No component may be NaN.
template <class Vec>
DTSDF_HD Vec minOf(const Vec& a, const Vec& b) {
  return {a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z};
}
template <class Vec>
DTSDF_HD Vec maxOf(const Vec& a, const Vec& b) {
  return {a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z};
}

/// Floor of a number that fits in an int32_t. Avoids floorf(), which is a library call on targets
/// such as x86-64 without SSE 4.1.
DTSDF_HD int32_t floorToInt(float a) {
  const auto truncated = static_cast<int32_t>(a);
  return truncated - (static_cast<float>(truncated) > a ? 1 : 0);
}
DTSDF_HD int32_t ceilToInt(float a) { return -floorToInt(-a); }

/// Floor of a / b. @pre b > 0.
DTSDF_HD int32_t floorDivided(int32_t a, int32_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

/// A rotation and a translation; `R` is row-major.
struct RigidTransform {
  float R[9];
  Vec3f t;
};

DTSDF_HD Vec3f rotate(const RigidTransform& T, const Vec3f& a) {
  return {T.R[0] * a.x + T.R[1] * a.y + T.R[2] * a.z, T.R[3] * a.x + T.R[4] * a.y + T.R[5] * a.z,
          T.R[6] * a.x + T.R[7] * a.y + T.R[8] * a.z};
}
DTSDF_HD Vec3f rotateInverse(const RigidTransform& T, const Vec3f& a) {
  return {T.R[0] * a.x + T.R[3] * a.y + T.R[6] * a.z, T.R[1] * a.x + T.R[4] * a.y + T.R[7] * a.z,
          T.R[2] * a.x + T.R[5] * a.y + T.R[8] * a.z};
}
DTSDF_HD Vec3f transform(const RigidTransform& T, const Vec3f& a) { return rotate(T, a) + T.t; }

}  // namespace dtsdf
