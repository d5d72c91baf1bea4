#include "meshing/tolerances.h"

#include <algorithm>

namespace dtsdf {
namespace {

/// What each of two opposing sides may use of what is between them.
constexpr double kShareBetween = 0.45;

/// Errors up to so many mean edges are common enough to measure gaps for them beforehand.
constexpr double kNearEdges = 2.0;

constexpr size_t kReportEvery = 4096;

}  // namespace

Tolerances::Tolerances(const Mesh& mesh, const std::vector<uint32_t>& vertices,
                       const FacingLimits& opposing, double mean_edge_m, double max_error_m,
                       const std::function<void(double share)>& report)
    : mesh_(mesh),
      opposing_(opposing),
      near_m_(std::min(max_error_m, kNearEdges * mean_edge_m)),
      max_error_m_(max_error_m),
      tree_(mesh.vertices_m, mesh.triangles),
      tolerance_m_(mesh.vertices_m.size()) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    if (i % kReportEvery == 0)
      report(static_cast<double>(i) / static_cast<double>(vertices.size()));
    tolerance_m_[vertices[i]] = measure(vertices[i], near_m_);
  }
}

/// Negative where no gap is found within what errors up to `error_m` need.
float Tolerances::measure(uint32_t vertex, double error_m) {
  const double limit_m = 1.01 * error_m / kShareBetween;
  const double gap_m =
      tree_.distance(mesh_.vertices_m[vertex], limit_m, mesh_.normals[vertex], opposing_, hint_);
  const auto tolerance_m = static_cast<float>(kShareBetween * gap_m);
  return gap_m < limit_m || error_m >= max_error_m_ ? tolerance_m : -tolerance_m;
}

double Tolerances::measured(uint32_t vertex, double error_m) {
  tolerance_m_[vertex] = measure(vertex, max_error_m_);
  return std::min(error_m, static_cast<double>(tolerance_m_[vertex]));
}

}  // namespace dtsdf
