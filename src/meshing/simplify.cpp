#include "dtsdf_mapping/simplify.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "kernels/core/vec.h"
#include "meshing/collapser.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// Errors in each decade: a mesh is simplified within one after the other, up to the one that is
/// asked for. So whoever asks for more gets what all before have left, and less of it.
constexpr double kStepsOfDecade[] = {1.0, 1.5, 2.0, 3.0, 5.0, 7.0};

/// Below this share of the mean edge hardly a vertex goes.
constexpr double kFirstShareOfEdge = 0.06;

/// Times that what is left is looked at within one error, and the share that has to go each time.
constexpr int kPasses = 6;
constexpr double kLeastGain = 0.1;

/// Where no more than this share of the vertices goes within one error, none does within the next.
constexpr double kEndGain = 1e-3;

/// An error of more mean edges than this counts as one of so many: no triangle is so large.
constexpr double kMostEdges = 24.0;

/// Below this share of it errors may be too small for what there is.
constexpr double kSmallShareOfEdge = 3.0;

constexpr size_t kReportEach = 4096;
constexpr size_t kMostErrors = 200;

/// Of the time, as far as progress is concerned.
constexpr double kSharePrepared = 0.3;

double meanEdge_m(const Mesh& mesh) {
  double sum_m = 0.0;
  for (const auto& t : mesh.triangles) {
    sum_m += norm(mesh.vertices_m[t[1]] - mesh.vertices_m[t[0]]);
  }
  return sum_m / static_cast<double>(mesh.triangles.size());
}

/// The errors to go through, which do not depend on the one that is asked for but for their end.
std::vector<double> errorsUpTo(double max_error_m, double mean_edge_m) {
  const double first_m = std::min(kFirstShareOfEdge * mean_edge_m, max_error_m);
  std::vector<double> errors;
  double last_m = 0.0;
  const int begin = static_cast<int>(std::floor(std::log10(std::max(first_m, 1e-12))));
  for (int decade = begin; errors.size() < kMostErrors; ++decade) {
    for (const double step : kStepsOfDecade) {
      const double error_m = step * std::pow(10.0, decade);
      if (error_m > max_error_m * (1.0 + 1e-9)) {
        if (errors.empty()) errors.push_back(last_m > 0.0 ? last_m : max_error_m);
        return errors;
      }
      last_m = error_m;
      if (error_m >= first_m) errors.push_back(error_m);
    }
  }
  return errors;
}

class Simplifier {
 public:
  Simplifier(const Mesh& mesh, double max_error_m, const SimplifyProgress& go_on)
      : mean_edge_m_(meanEdge_m(mesh)),
        max_error_m_(std::min(max_error_m, kMostEdges * mean_edge_m_)),
        go_on_(go_on),
        collapser_(mesh, mean_edge_m_, max_error_m_,
                   [this](double share) { report(kSharePrepared * share); }),
        live_(collapser_.removable()) {}

  SimplifiedMesh run() {
    const std::vector<double> errors = errorsUpTo(max_error_m_, mean_edge_m_);
    for (size_t i = 0; i < errors.size(); ++i) {
      const double begin = kSharePrepared + (1.0 - kSharePrepared) * i / errors.size();
      if (!simplifyWithin(errors[i], begin)) break;
    }
    SimplifiedMesh result;
    result.mesh = collapser_.remaining();
    result.error_m = collapser_.largestDistance_m(result.mesh);
    report(1.0);
    return result;
  }

 private:
  void report(double share) const {
    if (go_on_ && !go_on_(share)) throw SimplifyCancelled();
  }

  /// False once there is nothing more to gain.
  bool simplifyWithin(double error_m, double progress) {
    const size_t before = live_.size();
    collapser_.forgetTries();
    for (int pass = 0; pass < kPasses; ++pass) {
      size_t done = 0;
      const std::vector<Merge> merges = listMerges(error_m, progress);
      for (size_t i = 0; i < merges.size(); ++i) {
        if (i % kReportEach == 0) report(progress);
        done += collapser_.tryMerge(merges[i], error_m) ? 1 : 0;
      }
      live_.erase(std::remove_if(live_.begin(), live_.end(),
                                 [&](uint32_t v) { return collapser_.hasGone(v); }),
                  live_.end());
      if (static_cast<double>(done) < kLeastGain * static_cast<double>(live_.size())) break;
    }
    const bool is_small = error_m < kSmallShareOfEdge * mean_edge_m_;
    return is_small ||
           static_cast<double>(before - live_.size()) > kEndGain * static_cast<double>(before);
  }

  /// All are chosen before the first is made: where each would follow what the one before it left,
  /// a plane would turn into slivers. They stay in the order of the vertices, as neighbours lie
  /// together in memory.
  std::vector<Merge> listMerges(double error_m, double progress) {
    std::vector<Merge> merges;
    for (size_t i = 0; i < live_.size(); ++i) {
      if (i % kReportEach == 0) report(progress);
      const Merge merge = collapser_.cheapest(live_[i], error_m);
      if (merge.from != merge.to) merges.push_back(merge);
    }
    return merges;
  }

  const double mean_edge_m_;
  const double max_error_m_;
  const SimplifyProgress& go_on_;
  Collapser collapser_;
  std::vector<uint32_t> live_;  ///< Vertices that may still go.
};

double diagonalOf(const Mesh& mesh) {
  Vec3f low = mesh.vertices_m.front(), high = low;
  for (const Vec3f& p : mesh.vertices_m) {
    low = leastOf(low, p);
    high = greatestOf(high, p);
  }
  return static_cast<double>(norm(high - low));
}

}  // namespace

SimplifiedMesh simplifyMesh(const Mesh& mesh, double max_error_m, const SimplifyProgress& go_on) {
  if (!(max_error_m >= 0.0) || !std::isfinite(max_error_m)) {
    throw std::invalid_argument("the error of a simplified mesh must be a number of metres, or 0");
  }
  if (max_error_m == 0.0 || mesh.triangles.empty()) return {mesh, 0.0};
  const double diagonal_m = diagonalOf(mesh);
  if (max_error_m > diagonal_m) {
    throw std::invalid_argument("an error of " + shortestText(max_error_m) +
                                " m is more than the whole mesh, which is " +
                                shortestText(diagonal_m) + " m across");
  }
  return Simplifier(mesh, max_error_m, go_on).run();
}

}  // namespace dtsdf
