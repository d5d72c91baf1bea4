/// Options shared by several evaluation programs.
#pragma once

#include <optional>

#include "evaluation/picture.h"
#include "program/command_line.h"

namespace dtsdf {

/// Options for a picture. The camera pose is computed once the mesh is known.
struct PictureRequest {
  int width = 1000, height = 800;
  std::optional<double> focal_px;  ///< 1.2 times the width if not set.
  double azimuth_deg = 30.0, elevation_deg = 20.0;
  std::optional<Eigen::Vector3d> eye, target;  ///< Used instead of the angles if both are set.
};

void addPictureOptions(CommandLine& line, PictureRequest& request);

PictureOptions makePictureOptions(const PictureRequest& request, const Eigen::AlignedBox3f& bounds);

}  // namespace dtsdf
