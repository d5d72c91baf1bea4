#include "evaluation/mixed_pixels.h"

#include <cmath>

#include "evaluation/depth_edges.h"
#include "simulation/random.h"

namespace dtsdf {

namespace {

/// Keeps these random values independent of those used elsewhere.
constexpr uint64_t kStream = 0x6d69786564ULL;

/// Visits those of a pixel's four neighbours that lie in the image.
template <class Visit>
void forNeighbours(const ViewCamera& camera, int u, int v, Visit visit) {
  if (u > 0) visit(u - 1, v);
  if (u + 1 < camera.width) visit(u + 1, v);
  if (v > 0) visit(u, v - 1);
  if (v + 1 < camera.height) visit(u, v + 1);
}

}  // namespace

float mixDepths(float own_m, float other_m, float other_share) {
  const float own = (1.0f - other_share) / (own_m * own_m);
  const float other = other_share / (other_m * other_m);
  return (own * own_m + other * other_m) / (own + other);
}

std::vector<float> mixPixels(const std::vector<float>& depth_m, const ViewCamera& camera,
                             uint64_t seed) {
  Random random(seed ^ kStream);
  std::vector<float> mixed_m = depth_m;
  size_t pixel = 0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u, ++pixel) {
      const float share = static_cast<float>(0.5 * random.uniform());
      const float own_m = depth_m[pixel];
      if (own_m <= 0.0f) continue;
      float other_m = own_m;
      forNeighbours(camera, u, v, [&](int nu, int nv) {
        const float z_m = depth_m[camera.pixelAt(nu, nv)];
        if (z_m > 0.0f && std::abs(z_m - own_m) > std::abs(other_m - own_m)) other_m = z_m;
      });
      if (isDepthEdge(own_m, other_m)) mixed_m[pixel] = mixDepths(own_m, other_m, share);
    }
  }
  return mixed_m;
}

}  // namespace dtsdf
