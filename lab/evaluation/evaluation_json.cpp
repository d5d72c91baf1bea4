#include <nlohmann/json.hpp>

#include "evaluation/mesh_metrics.h"

namespace dtsdf {

namespace {

using Json = nlohmann::json;

Json toJsonValue(const DistanceStats& stats) {
  return {{"count", stats.count},          {"rmse_mm", 1e3 * stats.rmse_m},
          {"mean_mm", 1e3 * stats.mean_m}, {"median_mm", 1e3 * stats.median_m},
          {"p95_mm", 1e3 * stats.p95_m},   {"max_mm", 1e3 * stats.max_m}};
}

Json toJsonValue(const FScore& score) {
  return {{"threshold_mm", 1e3 * score.threshold_m},
          {"precision", score.precision},
          {"recall", score.recall},
          {"f_score", score.f_score}};
}

Json toJsonValue(const MeshTopology& topology) {
  return {{"vertices", topology.vertices},
          {"triangles", topology.triangles},
          {"boundary_edges", topology.boundary_edges},
          {"non_manifold_edges", topology.non_manifold_edges},
          {"components", topology.components},
          {"degenerate_triangles", topology.degenerate_triangles},
          {"area_m2", topology.area_m2}};
}

}  // namespace

std::string toJson(const Evaluation& evaluation) {
  Json scores = Json::array();
  for (const FScore& score : evaluation.f_scores) scores.push_back(toJsonValue(score));
  const Json json = {{"vertices", toJsonValue(evaluation.vertices)},
                     {"surface", toJsonValue(evaluation.surface)},
                     {"completeness", toJsonValue(evaluation.completeness)},
                     {"seen_share", evaluation.seen_share},
                     {"boundary_edges_beside_unseen", evaluation.boundary_edges_beside_unseen},
                     {"f_scores", scores},
                     {"topology", toJsonValue(evaluation.topology)}};
  return json.dump(2) + "\n";
}

}  // namespace dtsdf
