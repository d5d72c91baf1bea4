/// Ray casting and closest-point queries on a triangle mesh, using Embree.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>

#include "evaluation/triangle_mesh.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace dtsdf {

struct RayHit {
  float distance;  ///< In multiples of the length of the direction vector.
  uint32_t triangle;
  /// Unit normal according to the winding order; zero for a degenerate triangle.
  Eigen::Vector3f normal;
  Eigen::Vector2f barycentric;  ///< Weights of the second and third corner.
};

struct ClosestPoint {
  double distance_m;
  uint32_t triangle;
};

/// A triangle mesh in Embree. Queries may be called from several threads at once.
class MeshScene {
 public:
  /// @throws std::runtime_error if the mesh has no triangles or Embree fails.
  explicit MeshScene(const TriangleMesh& mesh);

  const TriangleMesh& mesh() const { return mesh_; }
  const Eigen::AlignedBox3f& bounds() const { return bounds_; }

  /// Unit normal according to the winding order; zero for a degenerate triangle.
  Eigen::Vector3f triangleNormal(uint32_t triangle) const;

  /// First hit of a ray, on either side of the surface. The direction need not be a unit vector.
  std::optional<RayHit> intersect(const Eigen::Vector3f& origin,
                                  const Eigen::Vector3f& direction) const;

  /// Whether the segment between two points hits no surface, ignoring the fraction `margin` of its
  /// length at the end.
  bool isFree(const Eigen::Vector3f& from, const Eigen::Vector3f& to, float margin) const;

  ClosestPoint closestPoint(const Eigen::Vector3f& p) const;

 private:
  const TriangleMesh mesh_;
  Eigen::AlignedBox3f bounds_;
  std::unique_ptr<RTCDeviceTy, void (*)(RTCDeviceTy*)> device_;
  std::unique_ptr<RTCSceneTy, void (*)(RTCSceneTy*)> scene_;
};

}  // namespace dtsdf
