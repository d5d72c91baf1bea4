/// Per shape: the ray intersection, the signed distance and the bounding sphere behind Scene.
#pragma once

#include <optional>

#include "simulation/scene.h"

namespace dtsdf {

/// In W; its direction has any length.
using Ray = Eigen::ParametrizedLine<double, 3>;

/// Smallest s > 0 at which the ray enters the shape's solid, or infinity.
double intersect(const Plane& plane, const Ray& ray);
double intersect(const Sphere& sphere, const Ray& ray);
double intersect(const Box& box, const Ray& ray);
double intersect(const Rod& rod, const Ray& ray);
double intersect(const Room& room, const Ray& ray);

/// Exact signed distance, negative inside the solid.
double signedDistance(const Plane& plane, const Eigen::Vector3d& p_W);
double signedDistance(const Sphere& sphere, const Eigen::Vector3d& p_W);
double signedDistance(const Box& box, const Eigen::Vector3d& p_W);
double signedDistance(const Rod& rod, const Eigen::Vector3d& p_W);
double signedDistance(const Room& room, const Eigen::Vector3d& p_W);

/// A sphere round the shape; none for shapes that fill the view anyway.
std::optional<Sphere> boundingSphere(const Shape& shape);

}  // namespace dtsdf
