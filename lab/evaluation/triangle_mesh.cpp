#include "evaluation/triangle_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "simulation/random.h"

namespace dtsdf {

void centreAndScale(TriangleMesh& mesh, float longest_side_m) {
  if (mesh.vertices.empty()) return;
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : mesh.vertices) bounds.extend(p);
  const float scale = longest_side_m / bounds.sizes().maxCoeff();
  const Eigen::Vector3f centre = bounds.center();
  for (Eigen::Vector3f& p : mesh.vertices) p = scale * (p - centre);
}

std::vector<double> triangleAreas(const TriangleMesh& mesh) {
  std::vector<double> areas;
  areas.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>();
    const Eigen::Vector3d ab = mesh.vertices[triangle[1]].cast<double>() - a;
    const Eigen::Vector3d ac = mesh.vertices[triangle[2]].cast<double>() - a;
    areas.push_back(0.5 * ab.cross(ac).norm());
  }
  return areas;
}

SurfaceSamples sampleSurface(const TriangleMesh& mesh, size_t count, uint64_t seed) {
  std::vector<double> cumulative = triangleAreas(mesh);
  double total = 0.0;
  for (double& area : cumulative) area = total += area;
  SurfaceSamples samples;
  if (total <= 0.0) return samples;
  Random random(seed);
  for (size_t i = 0; i < count; ++i) {
    // One sample per stratum of equal area, which has less variance than independent samples, and
    // no bias.
    const double at = (static_cast<double>(i) + random.uniform()) / static_cast<double>(count);
    const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), at * total);
    const size_t index =
        std::min<size_t>(static_cast<size_t>(found - cumulative.begin()), cumulative.size() - 1);
    const auto& triangle = mesh.triangles[index];
    const float root = static_cast<float>(std::sqrt(random.uniform()));
    const float share = static_cast<float>(random.uniform());
    samples.points.push_back((1.0f - root) * mesh.vertices[triangle[0]] +
                             root * (1.0f - share) * mesh.vertices[triangle[1]] +
                             root * share * mesh.vertices[triangle[2]]);
    samples.triangles.push_back(static_cast<uint32_t>(index));
  }
  return samples;
}

}  // namespace dtsdf
