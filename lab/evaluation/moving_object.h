/// A thing that is put into a recording: a box or a ball that moves along a straight line.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/camera_views.h"
#include "evaluation/triangle_mesh.h"

namespace dtsdf {

/// Lengths in metres in the map frame; the box's sides are parallel to its axes.
struct MovingObject {
  enum class Shape { kBox, kBall };

  Shape shape = Shape::kBox;
  Eigen::Vector3d size_m{0.3, 0.3, 0.3};  ///< Sides of the box; diameters of the ball along them.
  Eigen::Vector3d from_W{0, 0, 0};        ///< Centre at the beginning of the way,
  Eigen::Vector3d to_W{0, 0, 0};          ///< and at its end.

  /// The centre after a share of the way, from 0 to 1.
  Eigen::Vector3d centreAt(double share) const { return from_W + share * (to_W - from_W); }
};

/// @throws std::invalid_argument for an unknown name.
MovingObject::Shape objectShapeFromName(const std::string& name);

/// Where a ray meets the object first, in multiples of the direction's length; nothing if it misses
/// it or begins inside.
std::optional<double> intersect(const MovingObject& object, const Eigen::Vector3d& centre_W,
                                const Eigen::Vector3d& origin_W,
                                const Eigen::Vector3d& direction_W);

/// Whether the object, moved from the beginning to the end of its way, passes through a point; a
/// ball is taken as the box round it. `margin_m` is added on all sides.
bool sweeps(const MovingObject& object, const Eigen::Vector3d& p_W, double margin_m);

/// Puts the object into a depth image (row-major, metres, 0: nothing measured), in front of what is
/// farther away and where nothing was measured. Returns how many pixels show it.
size_t composite(const MovingObject& object, const Eigen::Vector3d& centre_W,
                 const ViewCamera& camera, const Eigen::Isometry3d& T_W_C,
                 std::vector<float>& depth_m);

/// What of a mesh is left of the object, as points of the mesh that stand for an area each.
struct Trail {
  double sample_m2 = 0.0;               ///< The area of each point.
  size_t swept = 0;                     ///< Points in the volume that the object passed through.
  std::vector<Eigen::Vector3f> points;  ///< Those not beside the mesh without the object, in W.
};

/// What counts as the object's trail.
struct TrailRule {
  double margin_m = 0.0;     ///< Added on all sides to the volume that it passed through.
  double distance_m = 0.05;  ///< What is nearer to the mesh without the object is no trail.
  size_t samples = 2000000;  ///< Points of the mesh to look at.
};

/// `reference` is the mesh of the recording without the object.
Trail findTrail(const TriangleMesh& mesh, const TriangleMesh& reference, const MovingObject& object,
                const TrailRule& rule);

/// Whether a depth image measured something more than `distance_m` behind a point, by the depth of
/// both: what is there cannot be.
bool seesThrough(const std::vector<float>& depth_m, const ViewCamera& camera,
                 const Eigen::Isometry3d& T_W_C, const Eigen::Vector3d& p_W, double distance_m);

/// How many images of a recording see through each point.
std::vector<size_t> countSeenThrough(const std::vector<Eigen::Vector3f>& points, const Views& views,
                                     const std::vector<size_t>& chosen, double distance_m);

}  // namespace dtsdf
