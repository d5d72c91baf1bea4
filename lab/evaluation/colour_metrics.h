/// Figures that compare the colours of a reconstructed mesh with those of the ground truth.
#pragma once

#include <string>

#include "evaluation/surface_texture.h"

namespace dtsdf {

struct ColourOptions {
  Texture texture = Texture::kVertices;  ///< Of the ground truth.
  size_t samples = 1000000;
  uint64_t seed = 1;
  double reach_m = 0.05;  ///< Samples farther from the ground truth are left out.
};

/// Over area-uniform samples of the reconstruction.
struct ColourEvaluation {
  size_t samples = 0;
  double rmse_rgb = 0.0;  ///< Of a channel, from 0 to 255.
  double rmse_lab = 0.0;  ///< Of the distance in CIE L*a*b* (1976).
  double median_lab = 0.0, p95_lab = 0.0;
};

/// @throws std::runtime_error if a mesh lacks the colours that are compared.
ColourEvaluation evaluateColours(const TriangleMesh& reconstruction,
                                 const TriangleMesh& ground_truth, const ColourOptions& options);

/// The figures as a JSON object.
std::string toJson(const ColourEvaluation& evaluation);

}  // namespace dtsdf
