#include <cstdio>

#include "dtsdf_mapping/evaluation/mesh_metrics.h"

namespace dtsdf {

namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

std::string statsJson(const DistanceStats& stats) {
  return "{\"count\": " + std::to_string(stats.count) +
         ", \"rmse_mm\": " + number(1e3 * stats.rmse_m) +
         ", \"mean_mm\": " + number(1e3 * stats.mean_m) +
         ", \"median_mm\": " + number(1e3 * stats.median_m) +
         ", \"p95_mm\": " + number(1e3 * stats.p95_m) +
         ", \"max_mm\": " + number(1e3 * stats.max_m) + "}";
}

}  // namespace

std::string toJson(const Evaluation& evaluation) {
  const MeshTopology& topology = evaluation.topology;
  std::string scores;
  for (const FScore& score : evaluation.f_scores) {
    scores += (scores.empty() ? "" : ", ") + ("{\"threshold_mm\": " + number(1e3 * score.threshold_m)) +
              ", \"precision\": " + number(score.precision) +
              ", \"recall\": " + number(score.recall) + ", \"f_score\": " + number(score.f_score) +
              "}";
  }
  return "{\n  \"vertices\": " + statsJson(evaluation.vertices) +
         ",\n  \"surface\": " + statsJson(evaluation.surface) +
         ",\n  \"completeness\": " + statsJson(evaluation.completeness) +
         ",\n  \"seen_share\": " + number(evaluation.seen_share) + ",\n  \"f_scores\": [" +
         scores + "],\n  \"topology\": {\"vertices\": " + std::to_string(topology.vertices) +
         ", \"triangles\": " + std::to_string(topology.triangles) +
         ", \"boundary_edges\": " + std::to_string(topology.boundary_edges) +
         ", \"non_manifold_edges\": " + std::to_string(topology.non_manifold_edges) +
         ", \"components\": " + std::to_string(topology.components) +
         ", \"degenerate_triangles\": " + std::to_string(topology.degenerate_triangles) +
         ", \"area_m2\": " + number(topology.area_m2) + "}\n}\n";
}

}  // namespace dtsdf
