#include "evaluation/seen_surface.h"

#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "evaluation/mesh_scene.h"
#include "evaluation/parallel.h"

namespace dtsdf {
namespace {

using Corners = std::array<Eigen::Vector3f, 3>;

Corners cornersOf(const TriangleMesh& mesh, size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

void append(const Corners& corners, TriangleMesh& mesh) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
}

/// The number of the corner that a triangle's longest side begins in.
size_t longestSide(const Corners& c) {
  size_t longest = 0;
  for (size_t i = 1; i < 3; ++i) {
    if ((c[(i + 1) % 3] - c[i]).norm() > (c[(longest + 1) % 3] - c[longest]).norm()) longest = i;
  }
  return longest;
}

/// Whether each triangle is hit by the ray of some pixel, so near and so steeply.
std::vector<bool> hitTriangles(const TriangleMesh& mesh, const Views& views, float max_depth_m,
                               float least_cosine) {
  const MeshScene scene(mesh);
  std::vector<std::atomic<uint8_t>> hit(mesh.triangles.size());
  forEachImage(views.poses_W_C.size(), [&](size_t i) {
    const Eigen::Matrix3f R_W_C = views.poses_W_C[i].linear().cast<float>();
    const Eigen::Vector3f eye_W = views.poses_W_C[i].translation().cast<float>();
    for (int v = 0; v < views.camera.height; ++v) {
      for (int u = 0; u < views.camera.width; ++u) {
        const Eigen::Vector3f ray_W = R_W_C * rayOf(views.camera.intrinsics, static_cast<float>(u),
                                                    static_cast<float>(v));
        const auto found = scene.intersect(eye_W, ray_W);
        if (!found || found->distance > max_depth_m) continue;  // z is 1 along the ray
        if (std::abs(found->normal.dot(ray_W)) < least_cosine * ray_W.norm()) continue;
        hit[found->triangle].store(1, std::memory_order_relaxed);
      }
    }
  });
  std::vector<bool> result;
  result.reserve(hit.size());
  for (const auto& is_hit : hit) result.push_back(is_hit != 0);
  return result;
}

TriangleMesh pick(const TriangleMesh& mesh, const std::vector<bool>& chosen) {
  TriangleMesh part;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (chosen[i]) append(cornersOf(mesh, i), part);
  }
  if (part.triangles.empty()) throw std::runtime_error("no view sees anything of the mesh");
  return part;
}

}  // namespace

TriangleMesh cutFinely(const TriangleMesh& mesh, float longest_side_m) {
  TriangleMesh fine;
  std::vector<Corners> waiting;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    waiting.push_back(cornersOf(mesh, i));
    while (!waiting.empty()) {
      const Corners c = waiting.back();
      waiting.pop_back();
      const size_t a = longestSide(c), b = (a + 1) % 3, apex = (a + 2) % 3;
      if (!((c[b] - c[a]).norm() > longest_side_m)) {
        append(c, fine);
        continue;
      }
      const Eigen::Vector3f middle = 0.5f * (c[a] + c[b]);
      waiting.push_back({c[a], middle, c[apex]});
      waiting.push_back({middle, c[b], c[apex]});
    }
  }
  return fine;
}

TriangleMesh seenSurface(const TriangleMesh& mesh, const Views& views,
                         const SeenSurfaceOptions& options) {
  // Whole triangles first, of any slant and distance: what is not hit hides nothing either.
  constexpr float kAnywhere_m = std::numeric_limits<float>::infinity();
  const TriangleMesh part = pick(mesh, hitTriangles(mesh, views, kAnywhere_m, 0.0f));
  const TriangleMesh fine = cutFinely(part, options.longest_side_m);
  return pick(fine, hitTriangles(fine, views, options.max_depth_m, options.least_cosine));
}

}  // namespace dtsdf
