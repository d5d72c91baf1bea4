#include "evaluation/colour_metrics.h"
#include "threads/parallel.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace dtsdf {
namespace {

/// Colour error at one sample. `squared_rgb` is negative if the sample is too far from the ground
/// truth.
struct ColourError {
  double squared_rgb = -1.0, lab = 0.0;
};

Eigen::Vector3d toVector(const Rgb8& colour) {
  return Eigen::Vector3d(colour[0], colour[1], colour[2]);
}

void checkColours(const TriangleMesh& mesh, const char* which) {
  if (mesh.colours.size() == mesh.vertices.size()) return;
  throw std::runtime_error(std::string("the ") + which + " has no colours to compare");
}

ColourEvaluation summarise(const std::vector<ColourError>& errors) {
  ColourEvaluation result;
  std::vector<double> lab;
  double squared_rgb = 0.0, squared_lab = 0.0;
  for (const ColourError& error : errors) {
    if (error.squared_rgb < 0.0) continue;
    squared_rgb += error.squared_rgb;
    squared_lab += error.lab * error.lab;
    lab.push_back(error.lab);
  }
  if (lab.empty()) return result;
  std::sort(lab.begin(), lab.end());
  const auto count = static_cast<double>(lab.size());
  result.samples = lab.size();
  result.rmse_rgb = std::sqrt(squared_rgb / (3.0 * count));
  result.rmse_lab = std::sqrt(squared_lab / count);
  result.median_lab = lab[lab.size() / 2];
  return result;
}

}  // namespace

ColourEvaluation evaluateColours(const TriangleMesh& reconstruction,
                                 const TriangleMesh& ground_truth, Texture texture,
                                 size_t sample_count) {
  constexpr double kReach_m = 0.05;
  checkColours(reconstruction, "reconstruction");
  if (texture == Texture::kVertices) checkColours(ground_truth, "ground truth");
  const MeshScene truth(ground_truth);
  const SurfaceSamples samples = sampleSurface(reconstruction, sample_count, 1);
  std::vector<ColourError> errors(samples.points.size());
  parallelFor<8>(errors.size(), 0, [&](size_t i) {
    const Eigen::Vector3f& p = samples.points[i];
    const ClosestPoint closest = truth.closestPoint(p);
    if (closest.distance_m > kReach_m) return;
    const Eigen::Vector3d own = vertexColourAt(reconstruction, samples.triangles[i], p);
    const Eigen::Vector3d wanted =
        toVector(textureColour(texture, ground_truth, closest.triangle, p));
    errors[i] = {(own - wanted).squaredNorm(), (toLab(own) - toLab(wanted)).norm()};
  });
  return summarise(errors);
}

std::string toJson(const ColourEvaluation& evaluation) {
  const nlohmann::json json = {{"samples", evaluation.samples},
                               {"rmse_rgb", evaluation.rmse_rgb},
                               {"rmse_lab", evaluation.rmse_lab},
                               {"median_lab", evaluation.median_lab}};
  return json.dump(2) + "\n";
}

}  // namespace dtsdf
