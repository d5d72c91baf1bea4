/// Metrics for a reconstructed mesh, compared with the ground truth.
#pragma once

#include <string>
#include <vector>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"

namespace dtsdf {

/// Statistics of a set of distances, in metres; all zero for an empty set.
struct DistanceStats {
  size_t count = 0;
  double rmse_m = 0.0, mean_m = 0.0, median_m = 0.0, p95_m = 0.0, max_m = 0.0;
};

DistanceStats distanceStats(std::vector<double> distances_m);

/// Topology by shared vertex indices: vertices at the same position are not merged, so two touching
/// surfaces count as separate. Vertices are merged only for border_edges and small_holes.
struct MeshTopology {
  size_t vertices = 0, triangles = 0;
  size_t boundary_edges = 0;  ///< Edges that belong to only one triangle.
  size_t border_edges = 0;    ///< The same, after vertices at the same position are merged.
  size_t small_holes = 0;     ///< Closed loops of border edges, in connected sets of 3 to 16.
  size_t components = 0;      ///< Sets of triangles connected through shared vertices.
};

MeshTopology meshTopology(const TriangleMesh& mesh);

/// The metrics as a JSON object.
std::string toJson(const MeshTopology& topology);

/// F-score at a distance (harmonic mean of precision and recall).
struct FScore {
  double threshold_m;
  double precision;  ///< Fraction of the reconstruction's samples near the ground truth.
  double recall;  ///< Fraction of the samples of the visible ground truth near the reconstruction.
  double f_score;
};

struct EvaluationOptions {
  size_t samples = 1000000;  ///< Per surface.
  std::vector<double> thresholds_m{0.005, 0.01, 0.025};
};

struct Evaluation {
  DistanceStats vertices;  ///< From vertices of the reconstruction to the ground truth.
  DistanceStats surface;   ///< From area-uniform samples of the reconstruction to the ground truth.
  DistanceStats completeness;  ///< From samples of the visible ground truth to the reconstruction.
  double seen_share = 1.0;  ///< Fraction of the ground truth's area that is visible in some view.
  std::vector<FScore> f_scores;
  MeshTopology topology;
};

/// Distances from points to a surface, in metres. Runs on all cores.
std::vector<double> distancesTo(const MeshScene& surface,
                                const std::vector<Eigen::Vector3f>& points);

/// Whether each sample of the surface is visible in some view: not occluded, with the surface at 3
/// degrees or more to the view ray and, if there are depth images, with about the same depth in the
/// image. Samples that are out of range or lost in every depth image count as not visible.
std::vector<bool> seenByViews(const MeshScene& surface, const SurfaceSamples& samples,
                              const Views& views);

/// Compares two meshes. Without views (nullptr), the whole ground truth counts as visible.
/// @throws std::runtime_error if one of the meshes has no triangles.
Evaluation evaluateMesh(const TriangleMesh& reconstruction, const TriangleMesh& ground_truth,
                        const Views* views, const EvaluationOptions& options);

/// The metrics as a JSON object, with distances in millimetres.
std::string toJson(const Evaluation& evaluation);

}  // namespace dtsdf
