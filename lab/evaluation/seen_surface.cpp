#include "evaluation/seen_surface.h"

#include <atomic>
#include <cmath>
#include <optional>
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

/// What the ray of a pixel's middle meets; none: nothing.
struct PixelHit {
  std::optional<RayHit> hit;
  Eigen::Vector3f ray_W, p_W;
};

/// What an image shows of a mesh.
class SeenImage {
 public:
  SeenImage(const MeshScene& scene, const ViewCamera& camera, const Eigen::Isometry3d& T_W_C)
      : camera_(camera) {
    const Eigen::Matrix3f R_W_C = T_W_C.linear().cast<float>();
    const Eigen::Vector3f eye_W = T_W_C.translation().cast<float>();
    hits_.reserve(camera.pixelCount());
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const Eigen::Vector3f ray_W =
            R_W_C * rayOf(camera.intrinsics, static_cast<float>(u), static_cast<float>(v));
        const auto hit = scene.intersect(eye_W, ray_W);  // z is 1 along the ray
        hits_.push_back({hit, ray_W, hit ? eye_W + hit->distance * ray_W : eye_W});
      }
    }
  }

  const PixelHit& at(int u, int v) const { return hits_[camera_.pixelAt(u, v)]; }

  /// Whether a pixel is one of some two by two that all show the surface that it shows.
  bool isSurface(int u, int v, float aside_m) const {
    const PixelHit& here = at(u, v);
    const auto goesOn = [&](int to_u, int to_v) {
      return to_u >= 0 && to_v >= 0 && to_u < camera_.width && to_v < camera_.height &&
             isOneSurface(here, at(to_u, to_v), aside_m);
    };
    for (const int du : {-1, 1}) {
      for (const int dv : {-1, 1}) {
        if (goesOn(u + du, v) && goesOn(u, v + dv) && goesOn(u + du, v + dv)) return true;
      }
    }
    return false;
  }

 private:
  /// Whether another pixel shows what goes on near the plane of the first one, facing about alike.
  static bool isOneSurface(const PixelHit& here, const PixelHit& other, float aside_m) {
    constexpr float kLeastCosine = 0.5f;
    return other.hit && std::abs(here.hit->normal.dot(other.hit->normal)) >= kLeastCosine &&
           std::abs(here.hit->normal.dot(other.p_W - here.p_W)) <= aside_m;
  }

  ViewCamera camera_;
  std::vector<PixelHit> hits_;
};

/// Whether some image shows each triangle: the middle of a pixel falls on it, and `counts` says so
/// of the image and the pixel.
template <class Counts>
std::vector<bool> hitTriangles(const TriangleMesh& mesh, const Views& views, const Counts& counts) {
  const MeshScene scene(mesh);
  std::vector<std::atomic<uint8_t>> hit(mesh.triangles.size());
  forEachImage(views.poses_W_C.size(), [&](size_t i) {
    const SeenImage image(scene, views.camera, views.poses_W_C[i]);
    for (int v = 0; v < views.camera.height; ++v) {
      for (int u = 0; u < views.camera.width; ++u) {
        const auto& found = image.at(u, v).hit;
        if (found && counts(image, u, v)) hit[found->triangle].store(1, std::memory_order_relaxed);
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
  // Whole triangles first, however they are seen: what is not hit hides nothing either.
  const auto always = [](const SeenImage&, int, int) { return true; };
  const TriangleMesh part = pick(mesh, hitTriangles(mesh, views, always));
  const TriangleMesh fine = cutFinely(part, options.longest_side_m);
  return pick(fine, hitTriangles(fine, views, [&](const SeenImage& image, int u, int v) {
                const PixelHit& pixel = image.at(u, v);
                return pixel.hit->distance <= options.max_depth_m &&
                       std::abs(pixel.hit->normal.dot(pixel.ray_W)) >=
                           options.least_cosine * pixel.ray_W.norm() &&
                       image.isSurface(u, v, options.longest_side_m);
              }));
}

}  // namespace dtsdf
