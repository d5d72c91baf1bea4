/// Pictures of meshes: shaded, with their own colours or coloured by error.
#pragma once

#include <string>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"

namespace dtsdf {

using Colour = std::array<uint8_t, 3>;  ///< RGB.

/// A colour from light grey (no error) through yellow and orange to dark red (`scale_m` or more).
Colour errorColour(double error_m, double scale_m);

/// Colours the mesh's vertices by error.
void colourByError(TriangleMesh& mesh, const std::vector<double>& errors_m, double scale_m);

struct PictureOptions {
  ViewCamera camera;
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  bool own_colours = true;  ///< Whether to use the mesh's colours, if it has any.
};

/// A pose with the whole mesh in view, from the given azimuth about y, which points up, and
/// elevation.
Eigen::Isometry3d framingPose(const Eigen::AlignedBox3f& bounds, const ViewCamera& camera,
                              double azimuth_deg, double elevation_deg);

/// Writes a .png of the mesh on a white background. The backs of triangles are brown, so that
/// missing sides are visible. @throws std::runtime_error if the file cannot be written.
void writePicture(const std::string& path, const MeshScene& scene, const PictureOptions& options);

}  // namespace dtsdf
