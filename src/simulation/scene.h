/// Analytic scenes: shapes with exact ray intersections and exact distances, for tests and demos.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <variant>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// An infinite plane with a solid half space behind it; `normal_W` points to the free side.
struct Plane {
  Eigen::Vector3d point_W;
  Eigen::Vector3d normal_W;  ///< Unit vector.
};

struct Sphere {
  Eigen::Vector3d centre_W;
  double radius_m;
};

/// A box with its own frame B at its centre; a thin plate is a box with one small side.
struct Box {
  Eigen::Isometry3d T_W_B;
  Eigen::Vector3d half_size_m;
};

/// A cylinder with flat ends.
struct Rod {
  Eigen::Vector3d start_W;
  Eigen::Vector3d end_W;
  double radius_m;
};

/// A box that is free inside and solid outside. Its faces are aligned with W.
using Room = Eigen::AlignedBox3d;

using Shape = std::variant<Plane, Sphere, Box, Rod, Room>;

/// An axis-aligned box, turned by `yaw_rad` about the vertical axis through its centre.
Box makeBox(const Eigen::Vector3d& centre_W, const Eigen::Vector3d& size_m, double yaw_rad = 0.0);

/// A union of solid shapes, in metres, in the map frame W.
class Scene {
 public:
  void add(const Shape& shape) { shapes_.push_back(shape); }
  const std::vector<Shape>& shapes() const { return shapes_; }

  /// Smallest s > 0 at which origin + s * direction enters a solid, or infinity. The direction need
  /// not be a unit vector.
  double intersect(const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W) const;

  /// Positive in free space, negative inside a solid, infinity in an empty scene. Exact except
  /// inside overlapping solids.
  double signedDistance(const Eigen::Vector3d& p_W) const;

  /// The distance to the nearest surface, never negative.
  double distanceToSurface(const Eigen::Vector3d& p_W) const;

 private:
  std::vector<Shape> shapes_;
};

/// Exact depth (z in the optical frame, metres, row-major) of every pixel; 0 where nothing is hit.
std::vector<float> renderDepth(const Scene& scene, const Intrinsics& intrinsics, int width,
                               int height, const Eigen::Isometry3d& T_W_C);

/// Wraps a depth image for a mapper. The frame points to `depth_m`, which must outlive it.
DepthFrame depthFrameOf(const std::vector<float>& depth_m, const Intrinsics& intrinsics, int width,
                        int height, const Eigen::Isometry3d& T_W_C);

/// Red, green and blue of a surface.
using Paint = std::array<uint8_t, 3>;

/// The colour at a point on the surface of a shape. Each face of a box or room has its own colour,
/// so that the two sides of a plate differ. Two shades of this colour alternate every 0.25 m.
Paint paintAt(const Scene& scene, size_t shape, const Eigen::Vector3d& p_W);

/// The colour of every pixel, row-major; black where nothing is hit.
std::vector<Paint> renderPaint(const Scene& scene, const Intrinsics& intrinsics, int width,
                               int height, const Eigen::Isometry3d& T_W_C);

/// The pose of a camera (x right, y down, z forward) at `eye_W` looking at `target_W`; `up_W` must
/// not be parallel to the line of sight.
Eigen::Isometry3d lookAt(const Eigen::Vector3d& eye_W, const Eigen::Vector3d& target_W,
                         const Eigen::Vector3d& up_W);

/// A 6 x 5 x 2.6 m room, with z up and the floor at z = 0. In the middle is a wall that is visible
/// from both sides; around it are plates 10, 20 and 40 mm thick and rods 20 to 60 mm thick.
Scene makeRoomScene();

/// `count` balls circling in the room of makeRoomScene(), at 10 s per lap. They pass the wall on
/// both sides and stay clear of the camera path of roomCameraPose().
std::vector<Sphere> roomBalls(int count, double time_s);

/// The pose of a camera that circles the middle of makeRoomScene() once in `lap_s` seconds, on a
/// smooth closed path from which both sides of the wall and of the plates are visible. Every pose
/// is inside the room, so every pixel has a depth.
Eigen::Isometry3d roomCameraPose(double time_s, double lap_s = 24.0);

}  // namespace dtsdf
