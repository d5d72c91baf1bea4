#include "evaluation/mesh_metrics.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

#include "evaluation/boundary_edges.h"
#include "threads/parallel.h"

namespace dtsdf {

namespace {

/// Disjoint sets of vertices, joined by triangles.
class VertexSets {
 public:
  explicit VertexSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(uint32_t a, uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<uint32_t> parent_;
};

size_t countComponents(const TriangleMesh& mesh) {
  VertexSets sets(mesh.vertices.size());
  for (const auto& triangle : mesh.triangles) {
    sets.join(triangle[0], triangle[1]);
    sets.join(triangle[0], triangle[2]);
  }
  std::vector<bool> counted(mesh.vertices.size(), false);
  size_t components = 0;
  for (const auto& triangle : mesh.triangles) {
    const uint32_t root = sets.find(triangle[0]);
    if (!counted[root]) ++components;
    counted[root] = true;
  }
  return components;
}

double shareWithin(const std::vector<double>& distances_m, double threshold_m) {
  if (distances_m.empty()) return 0.0;
  const auto near = std::count_if(distances_m.begin(), distances_m.end(),
                                  [&](double d) { return d <= threshold_m; });
  return static_cast<double>(near) / static_cast<double>(distances_m.size());
}

FScore fScore(const std::vector<double>& surface_m, const std::vector<double>& completeness_m,
              double threshold_m) {
  const double precision = shareWithin(surface_m, threshold_m);
  const double recall = shareWithin(completeness_m, threshold_m);
  const double sum = precision + recall;
  return {threshold_m, precision, recall, sum > 0.0 ? 2.0 * precision * recall / sum : 0.0};
}

std::vector<Eigen::Vector3f> select(const std::vector<Eigen::Vector3f>& points,
                                    const std::vector<bool>& selected) {
  std::vector<Eigen::Vector3f> result;
  for (size_t i = 0; i < points.size(); ++i) {
    if (selected[i]) result.push_back(points[i]);
  }
  return result;
}

/// The indices 0 .. count-1 in steps of about `count` divided by the golden ratio. The first few
/// views then cover the surface from all sides, so that few samples remain to be tested in the
/// other views.
std::vector<size_t> spreadOrder(size_t count) {
  size_t step = std::max<size_t>(1, static_cast<size_t>(0.618034 * static_cast<double>(count)));
  while (std::gcd(step, count) != 1) ++step;
  std::vector<size_t> order(count);
  for (size_t i = 0; i < count; ++i) order[i] = i * step % count;
  return order;
}

/// One view, for testing whether points on a surface are visible and were measured.
class View {
 public:
  View(const Views& views, size_t index)
      : camera_(views.camera),
        pose_C_W_(views.poses_W_C[index].inverse().cast<float>()),
        eye_W_(views.poses_W_C[index].translation().cast<float>()) {
    if (!views.depth_paths.empty()) {
      depth_m_ = readTumDepth(views.depth_paths[index], views.camera);
    }
  }

  bool sees(const MeshScene& surface, const Eigen::Vector3f& p_W,
            const Eigen::Vector3f& normal_W) const {
    // Rays end before the point, by this fraction of their length, so that the surface at the point
    // does not occlude it.
    constexpr float kMargin = 5.0e-5f;
    constexpr float kFlattestCosine = 0.05f;
    const Eigen::Vector3f view_W = eye_W_ - p_W;
    if (std::abs(view_W.dot(normal_W)) < kFlattestCosine * view_W.norm()) return false;
    return isMeasured(pose_C_W_ * p_W) && surface.isFree(eye_W_, p_W, kMargin);
  }

 private:
  /// Whether the point lies in the image, on a pixel of about the same depth.
  bool isMeasured(const Eigen::Vector3f& p_C) const {
    // Allows for noise and for slanted surfaces; occlusion is tested with a ray.
    constexpr float kDepthShare = 0.05f;
    if (p_C.z() <= 0.0f) return false;
    const Intrinsics& K = camera_.intrinsics;
    const float u = K.fx * p_C.x() / p_C.z() + K.cx, v = K.fy * p_C.y() / p_C.z() + K.cy;
    if (!(u >= -0.5f && v >= -0.5f && u < static_cast<float>(camera_.width) - 0.5f &&
          v < static_cast<float>(camera_.height) - 0.5f)) {
      return false;
    }
    if (depth_m_.empty()) return true;
    const auto column = static_cast<size_t>(u + 0.5f), row = static_cast<size_t>(v + 0.5f);
    const float depth_m = depth_m_[row * static_cast<size_t>(camera_.width) + column];
    return std::abs(depth_m - p_C.z()) <= kDepthShare * p_C.z();
  }

  ViewCamera camera_;
  Eigen::Isometry3f pose_C_W_;
  Eigen::Vector3f eye_W_;
  std::vector<float> depth_m_;  ///< Empty: no depth images.
};

using Json = nlohmann::json;

Json toJsonValue(const DistanceStats& stats) {
  return {{"count", stats.count},          {"rmse_mm", 1e3 * stats.rmse_m},
          {"mean_mm", 1e3 * stats.mean_m}, {"median_mm", 1e3 * stats.median_m},
          {"p95_mm", 1e3 * stats.p95_m},   {"max_mm", 1e3 * stats.max_m}};
}

Json toJsonValue(const MeshTopology& topology) {
  return {{"vertices", topology.vertices},
          {"triangles", topology.triangles},
          {"boundary_edges", topology.boundary_edges},
          {"border_edges", topology.border_edges},
          {"small_holes", topology.small_holes},
          {"components", topology.components}};
}

}  // namespace

DistanceStats distanceStats(std::vector<double> distances_m) {
  DistanceStats stats;
  stats.count = distances_m.size();
  if (distances_m.empty()) return stats;
  std::sort(distances_m.begin(), distances_m.end());
  const double count = static_cast<double>(distances_m.size());
  double sum = 0.0, squares = 0.0;
  for (const double d : distances_m) {
    sum += d;
    squares += d * d;
  }
  stats.rmse_m = std::sqrt(squares / count);
  stats.mean_m = sum / count;
  stats.median_m = distances_m[distances_m.size() / 2];
  stats.p95_m = distances_m[std::min(distances_m.size() - 1, static_cast<size_t>(0.95 * count))];
  stats.max_m = distances_m.back();
  return stats;
}

MeshTopology meshTopology(const TriangleMesh& mesh) {
  MeshTopology topology;
  topology.vertices = mesh.vertices.size();
  topology.triangles = mesh.triangles.size();
  topology.components = countComponents(mesh);
  topology.boundary_edges = boundaryEdges(mesh).size();
  const MeshBorder border = measureBorder(mesh);
  topology.border_edges = border.edges;
  topology.small_holes = border.small_holes;
  return topology;
}

std::string toJson(const MeshTopology& topology) { return toJsonValue(topology).dump(2) + "\n"; }

std::vector<double> distancesTo(const MeshScene& surface,
                                const std::vector<Eigen::Vector3f>& points) {
  std::vector<double> distances_m(points.size());
  parallelFor<64>(points.size(), 0,
                  [&](size_t i) { distances_m[i] = surface.closestPoint(points[i]).distance_m; });
  return distances_m;
}

std::vector<bool> seenByViews(const MeshScene& surface, const SurfaceSamples& samples,
                              const Views& views) {
  const std::vector<size_t> order = spreadOrder(views.poses_W_C.size());
  std::vector<uint8_t> seen(samples.points.size());  // bytes, since threads write adjacent elements
  for (size_t k = 0; k < order.size(); ++k) {
    const View view(views, order[k]);
    parallelFor<64>(seen.size(), 0, [&](size_t i) {
      if (seen[i] == 0) {
        seen[i] =
            view.sees(surface, samples.points[i], surface.triangleNormal(samples.triangles[i]));
      }
    });
  }
  return {seen.begin(), seen.end()};
}

Evaluation evaluateMesh(const TriangleMesh& reconstruction, const TriangleMesh& ground_truth,
                        const Views* views, const EvaluationOptions& options) {
  if (reconstruction.triangles.empty()) throw std::runtime_error("the reconstruction is empty");
  if (ground_truth.triangles.empty()) throw std::runtime_error("the ground truth is empty");
  const MeshScene reconstruction_scene(reconstruction), truth_scene(ground_truth);
  Evaluation evaluation;
  evaluation.topology = meshTopology(reconstruction);
  evaluation.vertices = distanceStats(distancesTo(truth_scene, reconstruction.vertices));
  const SurfaceSamples samples = sampleSurface(reconstruction, options.samples, 1);
  const std::vector<double> surface_m = distancesTo(truth_scene, samples.points);
  evaluation.surface = distanceStats(surface_m);
  const SurfaceSamples truth = sampleSurface(ground_truth, options.samples, 2);
  std::vector<Eigen::Vector3f> seen = truth.points;
  if (views != nullptr) {
    const std::vector<bool> is_seen = seenByViews(truth_scene, truth, *views);
    seen = select(truth.points, is_seen);
    evaluation.seen_share =
        static_cast<double>(seen.size()) / static_cast<double>(truth.points.size());
  }
  const std::vector<double> completeness_m = distancesTo(reconstruction_scene, seen);
  evaluation.completeness = distanceStats(completeness_m);
  for (const double threshold_m : options.thresholds_m) {
    evaluation.f_scores.push_back(fScore(surface_m, completeness_m, threshold_m));
  }
  return evaluation;
}

std::string toJson(const Evaluation& evaluation) {
  Json scores = Json::array();
  for (const FScore& score : evaluation.f_scores) {
    scores.push_back({{"threshold_mm", 1e3 * score.threshold_m},
                      {"precision", score.precision},
                      {"recall", score.recall},
                      {"f_score", score.f_score}});
  }
  const Json json = {{"vertices", toJsonValue(evaluation.vertices)},
                     {"surface", toJsonValue(evaluation.surface)},
                     {"completeness", toJsonValue(evaluation.completeness)},
                     {"seen_share", evaluation.seen_share},
                     {"f_scores", scores},
                     {"topology", toJsonValue(evaluation.topology)}};
  return json.dump(2) + "\n";
}

}  // namespace dtsdf
