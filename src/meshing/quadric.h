/// Squared distances from many planes, as one polynomial.
#pragma once

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// The sum of squared distances from planes, weighted.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, xd = 0, yy = 0, yz = 0, yd = 0, zz = 0, zd = 0, dd = 0, weight = 0;

  void add(const Vec3f& unit_normal, const Vec3f& point, double w) {
    const double x = unit_normal.x, y = unit_normal.y, z = unit_normal.z;
    const double d = -(x * point.x + y * point.y + z * point.z);
    xx += w * x * x, xy += w * x * y, xz += w * x * z, xd += w * x * d;
    yy += w * y * y, yz += w * y * z, yd += w * y * d;
    zz += w * z * z, zd += w * z * d, dd += w * d * d, weight += w;
  }

  void add(const Quadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, xd += q.xd, yy += q.yy, yz += q.yz, yd += q.yd;
    zz += q.zz, zd += q.zd, dd += q.dd, weight += q.weight;
  }

  double at(const Vec3f& p) const {
    const double x = p.x, y = p.y, z = p.z;
    return x * (xx * x + 2 * (xy * y + xz * z + xd)) + y * (yy * y + 2 * (yz * z + yd)) +
           z * (zz * z + 2 * zd) + dd;
  }
};

}  // namespace dtsdf
