#include "dtsdf_mapping/simplify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <tuple>

#include "kernels/core/vec.h"
#include "meshing/surface_distance.h"

#ifdef DTSDF_WITH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace dtsdf {

bool canSimplify() {
#ifdef DTSDF_WITH_MESHOPTIMIZER
  return true;
#else
  return false;
#endif
}

#ifdef DTSDF_WITH_MESHOPTIMIZER
namespace {

using Triangle = std::array<uint32_t, 3>;

/// Normals that differ by more than this face each other: cosine of 105 degrees.
constexpr float kOpposite = -0.25f;
constexpr FacingLimits kOpposing{-1.01f, kOpposite}, kSameSide{kOpposite, 1.01f};

/// The error is used up in steps, so that thin parts take what they can of the small ones; each in
/// tiles that lie differently: borders of tiles stay in one step, and go in the next.
constexpr double kSteps[] = {0.03125, 0.0625, 0.125, 0.25, 0.5};
constexpr double kTileShifts[] = {0.0, 0.5, 0.25, 0.75, 0.125};

/// A tile is so many errors wide: meshoptimizer works in float, in units of the tile.
constexpr double kTileErrors = 200.0, kLeastTile_m = 0.6;

/// What opposing sides may use of what is between them, both together.
constexpr double kShareBetween = 0.9;

/// Tries with less and less of the error, before the mesh is left as it is.
constexpr int kTries = 6;

/// Calls work(i) for each i below count, on all cores.
template <class Work>
void forEach(size_t count, const Work& work) {
  constexpr size_t kLeastPerThread = 1 << 12;
  const size_t threads = std::max<size_t>(
      1, std::min<size_t>(std::thread::hardware_concurrency(), count / kLeastPerThread));
  const auto part = [&](size_t n) {
    for (size_t i = count * n / threads; i < count * (n + 1) / threads; ++i) work(i);
  };
  std::vector<std::thread> others;
  for (size_t n = 1; n < threads; ++n) {
    try {
      others.emplace_back(part, n);
    } catch (const std::system_error&) {  // no thread to be had
      part(n);
    }
  }
  part(0);
  for (std::thread& other : others) other.join();
}

class Simplifier {
 public:
  Simplifier(const Mesh& mesh, double max_error_m) : mesh_(mesh), max_error_m_(max_error_m) {
    measureGaps();
  }

  SimplifiedMesh run() {
    double share = 1.0;
    for (int i = 0; i < kTries; ++i) {
      std::vector<Triangle> triangles = simplify(share * max_error_m_);
      const Outcome outcome = measure(triangles);
      if (outcome.sides_apart && outcome.error_m <= max_error_m_) {
        return {select(triangles), outcome.error_m};
      }
      share *= outcome.sides_apart ? std::min(0.7, 0.9 * max_error_m_ / outcome.error_m) : 0.5;
    }
    return {mesh_, 0.0};
  }

 private:
  struct Outcome {
    double error_m;
    bool sides_apart;
  };

  /// How far each vertex is from a surface that faces it, or looks the other way behind it.
  void measureGaps() {
    const double limit_m = 2.5 * max_error_m_;
    const SurfaceTree tree(mesh_.vertices_m, mesh_.triangles);
    gap_m_.resize(mesh_.vertices_m.size());
    forEach(gap_m_.size(), [&](size_t i) {
      gap_m_[i] = static_cast<float>(
          tree.distance(mesh_.vertices_m[i], limit_m, mesh_.normals[i], kOpposing));
    });
    no_gap_m_ = static_cast<float>(limit_m);
  }

  std::vector<Triangle> simplify(double error_m) const {
    std::vector<Triangle> triangles = mesh_.triangles;
    double used_m = 0.0;
    for (size_t step = 0; step < std::size(kSteps); ++step) {
      used_m += kSteps[step] * error_m;
      triangles = simplifyTiles(triangles, kSteps[step] * error_m, used_m, kTileShifts[step]);
    }
    return triangles;
  }

  /// Whether the sides stay apart at a vertex, when each has moved so far.
  bool isFree(uint32_t vertex, double used_m) const {
    return kShareBetween * static_cast<double>(gap_m_[vertex]) >= 2.0 * used_m;
  }

  std::vector<Triangle> simplifyTiles(const std::vector<Triangle>& triangles, double error_m,
                                      double used_m, double shift) const {
    const double tile_m = std::max(kTileErrors * max_error_m_, kLeastTile_m);
    std::vector<Triangle> result;
    std::map<std::tuple<int64_t, int64_t, int64_t>, std::vector<Triangle>> tiles;
    for (const Triangle& t : triangles) {
      if (isFree(t[0], used_m) && isFree(t[1], used_m) && isFree(t[2], used_m)) {
        const Vec3f& p = mesh_.vertices_m[t[0]];
        const auto tile = [&](float at) {
          return static_cast<int64_t>(std::floor(static_cast<double>(at) / tile_m + shift));
        };
        tiles[{tile(p.x), tile(p.y), tile(p.z)}].push_back(t);
      } else {
        result.push_back(t);
      }
    }
    for (const auto& [place, tile] : tiles) simplifyTile(tile, error_m, result);
    return result;
  }

  /// Appends what is left of a tile. Its borders stay.
  void simplifyTile(const std::vector<Triangle>& tile, double error_m,
                    std::vector<Triangle>& result) const {
    std::vector<uint32_t> vertices;
    for (const Triangle& t : tile) vertices.insert(vertices.end(), t.begin(), t.end());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::vector<Vec3f> positions;
    positions.reserve(vertices.size());
    const Vec3f origin = mesh_.vertices_m[vertices.front()];
    for (const uint32_t v : vertices) positions.push_back(mesh_.vertices_m[v] - origin);
    std::vector<unsigned> indices, left(3 * tile.size());
    for (const Triangle& t : tile) {
      for (const uint32_t v : t) {
        const auto at = std::lower_bound(vertices.begin(), vertices.end(), v);
        indices.push_back(static_cast<unsigned>(at - vertices.begin()));
      }
    }
    const float scale = meshopt_simplifyScale(&positions[0].x, positions.size(), sizeof(Vec3f));
    left.resize(meshopt_simplify(left.data(), indices.data(), indices.size(), &positions[0].x,
                                 positions.size(), sizeof(Vec3f), 0,
                                 static_cast<float>(error_m) / scale, meshopt_SimplifyLockBorder,
                                 nullptr));
    for (size_t i = 0; i + 2 < left.size(); i += 3) {
      result.push_back({vertices[left[i]], vertices[left[i + 1]], vertices[left[i + 2]]});
    }
  }

  /// Against the whole mesh: its vertices, of which those that are left need no look.
  Outcome measure(const std::vector<Triangle>& triangles) const {
    if (triangles.empty()) return {std::numeric_limits<double>::infinity(), true};
    std::vector<uint8_t> is_left(mesh_.vertices_m.size(), 0);
    for (const Triangle& t : triangles) is_left[t[0]] = is_left[t[1]] = is_left[t[2]] = 1;
    const SurfaceTree tree(mesh_.vertices_m, triangles);
    const double limit_m = 8.0 * max_error_m_;
    std::vector<float> error_m(is_left.size(), 0.0f);
    std::vector<uint8_t> crosses(is_left.size(), 0);
    forEach(is_left.size(), [&](size_t i) {
      if (is_left[i]) return;
      const Vec3f& p = mesh_.vertices_m[i];
      error_m[i] = static_cast<float>(tree.distance(p, limit_m));
      if (gap_m_[i] >= no_gap_m_) return;
      const double half_m = 0.5 * static_cast<double>(gap_m_[i]);
      crosses[i] = tree.distance(p, half_m, mesh_.normals[i], kSameSide) >= half_m;
    });
    const auto is_set = [](uint8_t value) { return value != 0; };
    return {static_cast<double>(*std::max_element(error_m.begin(), error_m.end())),
            std::none_of(crosses.begin(), crosses.end(), is_set)};
  }

  /// The mesh of these triangles, with its vertices in their old order.
  Mesh select(std::vector<Triangle>& triangles) const {
    std::vector<uint32_t> number(mesh_.vertices_m.size(), 0);
    for (const Triangle& t : triangles) number[t[0]] = number[t[1]] = number[t[2]] = 1;
    Mesh result;
    result.origin_m = mesh_.origin_m;
    for (size_t i = 0; i < number.size(); ++i) {
      if (number[i] == 0) continue;
      number[i] = static_cast<uint32_t>(result.vertices_m.size());
      result.vertices_m.push_back(mesh_.vertices_m[i]);
      result.normals.push_back(mesh_.normals[i]);
      if (!mesh_.colours.empty()) result.colours.push_back(mesh_.colours[i]);
    }
    for (Triangle& t : triangles) t = {number[t[0]], number[t[1]], number[t[2]]};
    result.triangles = std::move(triangles);
    return result;
  }

  const Mesh& mesh_;
  const double max_error_m_;
  std::vector<float> gap_m_;  ///< Of each vertex; no_gap_m_ where nothing is near enough to matter.
  float no_gap_m_ = 0.0f;
};

}  // namespace
#endif

SimplifiedMesh simplifyMesh([[maybe_unused]] const Mesh& mesh, double max_error_m) {
  if (!(max_error_m > 0.0) || !std::isfinite(max_error_m)) {
    throw std::invalid_argument("the error of a simplified mesh has to be a number above 0, in "
                                "metres");
  }
#ifdef DTSDF_WITH_MESHOPTIMIZER
  if (mesh.triangles.empty()) return {mesh, 0.0};
  return Simplifier(mesh, max_error_m).run();
#else
  throw std::runtime_error("this build cannot simplify meshes: install meshoptimizer "
                           "(libmeshoptimizer-dev, from Debian 12 and Ubuntu 22.04 on) and build "
                           "again");
#endif
}

}  // namespace dtsdf
