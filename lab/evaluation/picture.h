/// Renders shaded pictures of meshes, in their own colours or coloured by error.
#pragma once

#include <string>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"

namespace dtsdf {

using Colour = std::array<uint8_t, 3>;  ///< RGB.

/// Colour for an error, from light grey (no error) through yellow and orange to dark red (`scale_m`
/// or more).
Colour errorColour(double error_m, double scale_m);

/// Colours the vertices of a mesh by error.
void colourByError(TriangleMesh& mesh, const std::vector<double>& errors_m, double scale_m);

struct PictureOptions {
  ViewCamera camera;
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  bool own_colours = true;  ///< Whether to use the colours of the mesh, if it has any.
};

/// A camera pose from which the whole mesh is visible, at the given elevation and azimuth about y,
/// which points up.
Eigen::Isometry3d framingPose(const Eigen::AlignedBox3f& bounds, const ViewCamera& camera,
                              double azimuth_deg, double elevation_deg);

/// Renders the mesh on a white background into a .png file. The backs of triangles are brown, so
/// that missing sides are noticed. @throws std::runtime_error if the file cannot be written.
void writePicture(const std::string& path, const MeshScene& scene, const PictureOptions& options);

}  // namespace dtsdf
