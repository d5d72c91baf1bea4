/// Metrics for the colours of a reconstructed mesh, compared with the ground truth.
#pragma once

#include <string>

#include "evaluation/surface_texture.h"

namespace dtsdf {

/// Colour errors at points sampled uniformly by area on the reconstruction.
struct ColourEvaluation {
  size_t samples = 0;
  double rmse_rgb = 0.0;    ///< Over all three channels, whose values range from 0 to 255.
  double rmse_lab = 0.0;    ///< RMS of the distance in CIE L*a*b* (1976).
  double median_lab = 0.0;  ///< Median of the distance in CIE L*a*b*.
};

/// Compares the colours of a mesh with those that `texture` gives the ground truth. Samples farther
/// than 50 mm from the ground truth are ignored.
/// @throws std::runtime_error if a mesh has no colours to compare.
ColourEvaluation evaluateColours(const TriangleMesh& reconstruction,
                                 const TriangleMesh& ground_truth, Texture texture, size_t samples);

/// The metrics as a JSON object.
std::string toJson(const ColourEvaluation& evaluation);

}  // namespace dtsdf
