/// A mesh as separate triangles, and functions that measure parts of it.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "simulation/scene.h"

namespace dtsdf {

struct FlatTriangle {
  Eigen::Vector3d a, b, c;

  Eigen::Vector3d centroid() const { return (a + b + c) / 3.0; }
  double area() const { return 0.5 * (b - a).cross(c - a).norm(); }
};

using Surface = std::vector<FlatTriangle>;
using Zone = std::function<bool(const Eigen::Vector3d&)>;

Surface surfaceOf(const Mesh& mesh);

/// Triangles whose centroid lies in the zone.
Surface partOf(const Surface& surface, const Zone& zone);

/// Splits triangles until no side is longer than `longest_side_m`.
Surface refine(const Surface& surface, double longest_side_m);

double areaOf(const Surface& surface);
double areaOf(const Surface& surface, const Zone& zone);

/// Area of the part of the surface that is more than `distance_m` away from the scene.
double areaAwayFrom(const Scene& truth, double distance_m, const Surface& surface);

/// Counts the sides that belong to only one triangle and have both ends in the zone.
size_t countOpenEdges(const Mesh& mesh, const Zone& zone);

using Points = std::vector<Eigen::Vector3d>;

/// A grid of points on the rectangle centre +- half_u +- half_v, including its rim.
Points pointsOnRectangle(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_u,
                         const Eigen::Vector3d& half_v, double spacing_m);

/// Keeps one point per cube of a grid with edges of `side_m`, so that points are spread evenly.
Points thinOut(const Points& points, double side_m);

/// Percentage of the points less than `within_m` away from a triangle; NaN if there are no points.
double coveredPercent(const Points& points, const Surface& surface, double within_m);

}  // namespace dtsdf
