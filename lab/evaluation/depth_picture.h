/// Pictures of where a mesh differs from a depth image.
#pragma once

#include <string>
#include <vector>

#include "evaluation/depth_renderer.h"
#include "evaluation/picture.h"

namespace dtsdf {

/// Grey where the mesh is within 1 % of the depth, from there to 5 % ever more red where it is in
/// front of what was measured, or blue where it lies behind; darker where it is seen flat.
Colour differenceColour(double behind_share, double incidence_cosine);

/// Writes a .png in these colours with a legend below: amber where the mesh has nothing, white
/// where nothing was measured. Small images are enlarged. The depth is row-major, in metres.
/// @throws std::runtime_error if it cannot be written.
void writeDepthPicture(const std::string& path, const std::vector<float>& measured_m,
                       const DepthView& mesh, const ViewCamera& camera);

}  // namespace dtsdf
