/// evaluate_mesh: compares a reconstructed mesh with the ground truth.

#include <cstdio>
#include <exception>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "command_line.h"
#include "dtsdf_mapping/evaluation/mesh_metrics.h"

namespace {

constexpr char kUsage[] =
    R"(usage: evaluate_mesh RECONSTRUCTION.ply GROUNDTRUTH.ply [options]

Prints, as JSON: distances of the reconstruction's vertices and of area-uniform samples of it to the
ground truth, distances of the ground truth's samples to the reconstruction (completeness), F-scores
and the mesh's topology. Vertices are taken as they are indexed; none are welded.

  --views DIR        count only the ground truth that some view of this TUM folder sees
  --samples N        samples of each surface (1000000)
  --seed N           seed of the samples (1)
  --threshold M,...  distances for the F-score in metres (0.005,0.01,0.025)
  --json OUT.json    write the figures there as well
)";

void evaluate(const dtsdf::CommandLine& arguments) {
  const dtsdf::TriangleMesh reconstruction = dtsdf::readPly(arguments.positional()[0]);
  const dtsdf::TriangleMesh ground_truth = dtsdf::readPly(arguments.positional()[1]);
  std::optional<dtsdf::Views> views;
  if (arguments.has("views")) views = dtsdf::readViews(arguments.text("views", ""));
  dtsdf::EvaluationOptions options;
  options.samples = static_cast<size_t>(arguments.number("samples", 1e6, 1, 1e9));
  options.seed = static_cast<uint64_t>(arguments.number("seed", 1, 0, 1e15));
  options.thresholds_m = arguments.numbers("threshold", options.thresholds_m);
  const std::string json = dtsdf::toJson(
      dtsdf::evaluateMesh(reconstruction, ground_truth, views ? &*views : nullptr, options));
  std::fputs(json.c_str(), stdout);
  if (!arguments.has("json")) return;
  std::ofstream out(arguments.text("json", ""));
  out << json;
  out.close();
  if (!out) throw std::runtime_error(arguments.text("json", "") + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const dtsdf::CommandLine arguments(argc, argv,
                                       {"views", "samples", "seed", "threshold", "json"}, {"help"});
    if (arguments.has("help") || arguments.positional().size() != 2) {
      std::fputs(kUsage, arguments.has("help") ? stdout : stderr);
      return arguments.has("help") ? 0 : 2;
    }
    evaluate(arguments);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "evaluate_mesh: %s\n", error.what());
    return 1;
  }
}
