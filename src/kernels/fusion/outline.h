#pragma once
#include "kernels/fusion/free_space.h"
namespace dtsdf {
enum class Shown { kNothing, kSurface, kThrough };
inline Shown shownAt(const FrameSensing& s, const VoxelInImage& at) {
  const FrameView& f = s.image.frame;
  if (!isInImage(f, at)) return Shown::kNothing;
  const int64_t i = (int64_t)(int)at.v * f.width + (int)at.u;
  const float free = s.free_depth[i];
  if (at.depth_m < free) return Shown::kThrough;
  const float q = fabsf(s.image.inverse_depth[i]);
  if (!(q > 0.0f) || !(free > 0.0f)) return Shown::kNothing;
  const float z = 1.0f / q;
  return at.depth_m <= z + (z - free) ? Shown::kSurface : Shown::kNothing;
}
/// P: foot in voxels in L; g unit normal. @return whether there is a vote.
inline bool outlineVote(const FrameSensing& s, const Vec3f& P, const Vec3f& g, float& vote) {
  const FrameView& f = s.image.frame;
  const Shown centre = shownAt(s, projectToImage(f, P));
  if (centre == Shown::kNothing) return false;
  const Vec3f a = fabsf(g.x) < 0.6f ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0};
  Vec3f e1 = a - dot(a, g) * g;
  e1 = (1.0f / norm(e1)) * e1;
  const Vec3f e2{g.y * e1.z - g.z * e1.y, g.z * e1.x - g.x * e1.z, g.x * e1.y - g.y * e1.x};
  const Shown other = centre == Shown::kSurface ? Shown::kThrough : Shown::kSurface;
  static const float c8[8] = {1, .70710678f, 0, -.70710678f, -1, -.70710678f, 0, .70710678f};
  float found = 0;
  for (int j = 1; j <= 4 && found == 0; ++j) {
    const float r = 0.25f * j;
    for (int k = 0; k < 8; ++k) {
      const Vec3f Q = P + (r * c8[k]) * e1 + (r * c8[(k + 6) & 7]) * e2;
      if (shownAt(s, projectToImage(f, Q)) == other) { found = r - 0.125f; break; }
    }
  }
  if (found == 0) found = 1;
  vote = centre == Shown::kSurface ? minimum(found, kClipIn) : -found;
  return true;
}
}
