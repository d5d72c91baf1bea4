/// Renders depth and colour images of a triangle mesh and writes them to a TUM folder.
#pragma once

#include <vector>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"
#include "evaluation/surface_texture.h"

namespace dtsdf {

/// Rendered depth image and viewing angles, row-major.
struct DepthView {
  std::vector<float> depth_m;           ///< z in the optical frame; 0: no surface.
  std::vector<float> incidence_cosine;  ///< |cos| of the angle between view ray and surface normal.
};

DepthView renderView(const MeshScene& scene, const ViewCamera& camera,
                     const Eigen::Isometry3d& T_W_C);

/// Renders a colour image, row-major. Each pixel is the mean over 2 x 2 rays. Rays without a hit
/// are grey.
std::vector<Rgb8> renderColours(const MeshScene& scene, Texture texture, const ViewCamera& camera,
                                const Eigen::Isometry3d& T_W_C);

/// Converts depths to units of 1/5000 m, as in the TUM format; 0 if missing or too far.
std::vector<uint16_t> toTumDepth(const std::vector<float>& depth_m);

/// Writes a TUM folder image by image; finish() writes the lists, the trajectory and the camera.
/// Several threads may call write() and writeColours() concurrently.
class TumWriter {
 public:
  /// Creates the folder for images taken at `rate_hz`. Each colour pose adds a colour image, taken
  /// half a period after the depth image with the same index.
  /// @throws std::runtime_error if the folder cannot be created.
  TumWriter(const std::string& directory, const ViewCamera& camera,
            const std::vector<Eigen::Isometry3d>& poses_W_C, double rate_hz = 10.0,
            const std::vector<Eigen::Isometry3d>& colour_poses_W_C = {});

  void write(size_t index, const std::vector<uint16_t>& depth) const;
  void writeColours(size_t index, const std::vector<Rgb8>& colours) const;
  void finish(const std::string& camera_name) const;

 private:
  double stampOf(double index) const;

  std::string directory_;
  ViewCamera camera_;
  std::vector<Eigen::Isometry3d> poses_W_C_;
  double period_s_;
  std::vector<Eigen::Isometry3d> colour_poses_W_C_;  ///< Empty: no colour images.
};

}  // namespace dtsdf
