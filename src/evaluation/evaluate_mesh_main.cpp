/// evaluate_mesh: compares a reconstructed mesh with the ground truth.

#include <cstdio>
#include <exception>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "evaluation/mesh_metrics.h"
#include "evaluation/picture_options.h"

namespace dtsdf {
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
  --heatmap OUT.ply  the reconstruction, coloured by its vertices' distance to the ground truth
  --picture OUT.png  a picture of that with a scale; the view is chosen by:
)";

constexpr char kScaleUsage[] =
    "  --scale-mm S       full scale of the colours (a round number above the 95th percentile)\n";

Evaluation measure(const CommandLine& arguments, const TriangleMesh& reconstruction,
                   const TriangleMesh& ground_truth) {
  std::optional<Views> views;
  if (arguments.has("views")) views = readViews(arguments.text("views", ""));
  EvaluationOptions options;
  options.samples = static_cast<size_t>(arguments.number("samples", 1e6, 1, 1e9));
  options.seed = static_cast<uint64_t>(arguments.number("seed", 1, 0, 1e15));
  options.thresholds_m = arguments.numbers("threshold", options.thresholds_m);
  options.show_progress = true;
  return evaluateMesh(reconstruction, ground_truth, views ? &*views : nullptr, options);
}

void writeJson(const std::string& path, const std::string& json) {
  std::ofstream out(path);
  out << json;
  out.close();
  if (!out) throw std::runtime_error(path + ": cannot be written");
}

void writeErrorColours(const CommandLine& arguments, TriangleMesh reconstruction,
                       const TriangleMesh& ground_truth) {
  const std::vector<double> errors_m =
      distancesTo(MeshScene(ground_truth), reconstruction.vertices);
  const double automatic_mm = 1e3 * niceErrorScale(errors_m);
  const double scale_mm = arguments.number("scale-mm", automatic_mm, 1e-6, 1e6);
  colourByError(reconstruction, errors_m, 1e-3 * scale_mm);
  if (arguments.has("heatmap")) writePly(arguments.text("heatmap", ""), reconstruction);
  if (!arguments.has("picture")) return;
  const MeshScene scene(reconstruction);
  PictureOptions options = readPictureOptions(arguments, scene.bounds());
  options.legend = Legend{"error, mm", scale_mm};
  // Room for the scale at the right.
  options.camera.intrinsics.cx -= 0.06f * static_cast<float>(options.camera.width);
  writePicture(arguments.text("picture", ""), scene, options);
}

void evaluate(const CommandLine& arguments) {
  const TriangleMesh reconstruction = readPly(arguments.positional()[0]);
  const TriangleMesh ground_truth = readPly(arguments.positional()[1]);
  const std::string json = toJson(measure(arguments, reconstruction, ground_truth));
  std::fputs(json.c_str(), stdout);
  if (arguments.has("json")) writeJson(arguments.text("json", ""), json);
  if (arguments.has("heatmap") || arguments.has("picture")) {
    writeErrorColours(arguments, reconstruction, ground_truth);
  }
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  try {
    std::set<std::string> options = dtsdf::pictureOptionNames();
    options.insert(
        {"views", "samples", "seed", "threshold", "json", "heatmap", "picture", "scale-mm"});
    const dtsdf::CommandLine arguments(argc, argv, options, {"help"});
    if (arguments.has("help") || arguments.positional().size() != 2) {
      const std::string usage = dtsdf::kUsage + dtsdf::pictureUsage() + dtsdf::kScaleUsage;
      std::fputs(usage.c_str(), arguments.has("help") ? stdout : stderr);
      return arguments.has("help") ? 0 : 2;
    }
    dtsdf::evaluate(arguments);
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "evaluate_mesh: %s (see --help)\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "evaluate_mesh: %s\n", error.what());
    return 1;
  }
}
