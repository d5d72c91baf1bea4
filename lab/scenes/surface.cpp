#include "scenes/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "meshing/surface_distance.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

using Cell = std::array<int, 3>;

Vec3f toVec(const Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

Cell cellOf(const Vector3d& p, double side) {
  return {static_cast<int>(std::floor(p.x() / side)), static_cast<int>(std::floor(p.y() / side)),
          static_cast<int>(std::floor(p.z() / side))};
}

void addRefined(const FlatTriangle& t, double longest_side_m, Surface& result) {
  const double ab = (t.b - t.a).norm(), bc = (t.c - t.b).norm(), ca = (t.a - t.c).norm();
  const double longest = std::max({ab, bc, ca});
  if (longest <= longest_side_m) {
    result.push_back(t);
  } else if (longest == ab) {
    const Vector3d middle = 0.5 * (t.a + t.b);
    addRefined({t.a, middle, t.c}, longest_side_m, result);
    addRefined({middle, t.b, t.c}, longest_side_m, result);
  } else {  // rotate the corners until the longest side comes first
    addRefined(longest == bc ? FlatTriangle{t.b, t.c, t.a} : FlatTriangle{t.c, t.a, t.b},
               longest_side_m, result);
  }
}

}  // namespace

Surface surfaceOf(const Mesh& mesh) {
  const auto corner = [&](uint32_t i) {
    const std::array<double, 3> p_W = positionInMap(mesh, i);
    return Vector3d(p_W[0], p_W[1], p_W[2]);
  };
  Surface surface;
  surface.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    surface.push_back({corner(t[0]), corner(t[1]), corner(t[2])});
  }
  return surface;
}

Surface partOf(const Surface& surface, const Zone& zone) {
  Surface part;
  std::copy_if(surface.begin(), surface.end(), std::back_inserter(part),
               [&](const FlatTriangle& t) { return zone(t.centroid()); });
  return part;
}

Surface refine(const Surface& surface, double longest_side_m) {
  Surface result;
  for (const FlatTriangle& t : surface) addRefined(t, longest_side_m, result);
  return result;
}

double areaOf(const Surface& surface) {
  double area = 0.0;
  for (const FlatTriangle& t : surface) area += t.area();
  return area;
}

double areaOf(const Surface& surface, const Zone& zone) { return areaOf(partOf(surface, zone)); }

double areaAwayFrom(const Scene& truth, double distance_m, const Surface& surface) {
  return areaOf(surface,
                [&](const Vector3d& p) { return truth.distanceToSurface(p) > distance_m; });
}

size_t countOpenEdges(const Mesh& mesh, const Zone& zone) {
  std::map<std::pair<uint32_t, uint32_t>, int> passes;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const uint32_t a = t[i], b = t[(i + 1) % 3];
      ++passes[{std::min(a, b), std::max(a, b)}];
    }
  }
  const auto inside = [&](uint32_t i) {
    const std::array<double, 3> p_W = positionInMap(mesh, i);
    return zone(Vector3d(p_W[0], p_W[1], p_W[2]));
  };
  return static_cast<size_t>(std::count_if(passes.begin(), passes.end(), [&](const auto& side) {
    return side.second == 1 && inside(side.first.first) && inside(side.first.second);
  }));
}

Points pointsOnRectangle(const Vector3d& centre, const Vector3d& half_u, const Vector3d& half_v,
                         double spacing_m) {
  const int count_u = std::max(1, static_cast<int>(std::ceil(2.0 * half_u.norm() / spacing_m)));
  const int count_v = std::max(1, static_cast<int>(std::ceil(2.0 * half_v.norm() / spacing_m)));
  Points points;
  for (int j = 0; j <= count_v; ++j) {
    for (int i = 0; i <= count_u; ++i) {
      points.push_back(centre + (2.0 * i / count_u - 1.0) * half_u +
                       (2.0 * j / count_v - 1.0) * half_v);
    }
  }
  return points;
}

Points thinOut(const Points& points, double side_m) {
  std::map<Cell, Vector3d> first;
  for (const Vector3d& p : points) first.emplace(cellOf(p, side_m), p);
  Points result;
  for (const auto& entry : first) result.push_back(entry.second);
  return result;
}

double coveredPercent(const Points& points, const Surface& surface, double within_m) {
  if (points.empty()) return std::numeric_limits<double>::quiet_NaN();
  if (surface.empty()) return 0.0;
  std::vector<Vec3f> vertices_m;
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const FlatTriangle& t : surface) {
    const auto first = static_cast<uint32_t>(vertices_m.size());
    triangles.push_back({first, first + 1, first + 2});
    for (const Vector3d& corner : {t.a, t.b, t.c}) vertices_m.push_back(toVec(corner));
  }
  const SurfaceTree tree(vertices_m, triangles);
  const auto covered = std::count_if(points.begin(), points.end(), [&](const Vector3d& p) {
    return tree.distance(toVec(p), within_m) < within_m;
  });
  return 100.0 * static_cast<double>(covered) / static_cast<double>(points.size());
}

}  // namespace dtsdf
