/// Views of analytic scenes, and a map into which they are fused.
#pragma once

#include <memory>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "scenes/scene_case.h"
#include "scenes/surface.h"
#include "simulation/scene.h"

namespace dtsdf {

/// Offset that keeps shapes off the grid planes.
constexpr double kOff_m = 0.0037;

/// A camera with square pixels and its principal point at the image centre.
struct SceneCamera {
  int width, height;
  double focal_px;
};

/// The camera of most scenes: 63 x 49 degrees at its default width, like a Kinect at half
/// resolution.
SceneCamera roomCamera(const SceneSetup& setup);

/// A camera with the default field of view of roomCamera() and half its resolution, for long runs.
SceneCamera coarseCamera();

/// A depth image in metres with its camera and pose.
struct SceneView {
  SceneCamera camera;
  Eigen::Isometry3d T_W_C;
  std::vector<float> depth_m;

  Intrinsics intrinsics() const;
  DepthFrame frame() const;  ///< Valid as long as this object exists and is not moved.
  float& at(int u, int v);
  float at(int u, int v) const;
  size_t indexOf(int u, int v) const;
  /// The point in W at pixel (u, v) and depth `z_m`.
  Eigen::Vector3d point(int u, int v, double z_m) const;
};

SceneView look(const Scene& scene, const SceneCamera& camera, const Eigen::Isometry3d& T_W_C);

/// Pose of a camera at `eye_W` looking at `target_W`. Up is -y, as in the camera's own frame, so a
/// camera that looks along z has axes parallel to the map's.
Eigen::Isometry3d lookFrom(const Eigen::Vector3d& eye_W, const Eigen::Vector3d& target_W);

/// Pose of a camera at `eye_W` looking along z.
Eigen::Isometry3d lookAlongZ(const Eigen::Vector3d& eye_W);

/// Offset in image i of a camera that is held still by hand: at most `reach_m` along each axis.
Eigen::Vector3d sway(int i, double reach_m);

/// The plane z = `z_m`, facing -z.
Plane wallAt(double z_m);

/// A board facing -z, with its front in the plane z = `front_z_m`.
Box boardAt(double x_m, double y_m, double front_z_m, double width_m, double height_m,
            double thickness_m = 0.01);

/// A mapper that fuses views of scenes, and its mesh.
class SceneMap {
 public:
  explicit SceneMap(const SceneSetup& setup);

  /// Fuses a view `times` times. @throws std::runtime_error if a frame is not completely fused; a
  /// frame with nothing in range is not an error.
  void fuse(const SceneView& view, int times = 1);

  /// Fuses `count` views along z, taken from `eye_W` + sway(i, `reach_m`) for image i.
  void watch(const Scene& scene, const SceneCamera& camera, const Eigen::Vector3d& eye_W, int count,
             double reach_m = 0.01);

  /// The current surface.
  Surface surface();
  Mesh mesh();

  ProbedMapper& mapper() { return *mapper_; }

 private:
  std::unique_ptr<ProbedMapper> mapper_;
  MeshStore store_;
};

}  // namespace dtsdf
