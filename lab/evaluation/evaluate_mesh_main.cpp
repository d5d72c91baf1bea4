/// evaluate_mesh: compares a reconstructed mesh with the ground truth.

#include <cstdio>
#include <optional>

#include "evaluation/colour_metrics.h"
#include "evaluation/mesh_metrics.h"
#include "evaluation/shared_options.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct EvaluateMeshOptions {
  std::string reconstruction_path, ground_truth_path;
  bool topology_only = false;
  std::string views_folder, picture_path;  ///< Empty: none.
  EvaluationOptions evaluation;
  double scale_mm = 10.0;
  std::optional<Texture> texture;  ///< Texture of the ground truth, if colours are compared.
  PictureRequest picture;
};

void addMeasureOptions(CommandLine& line, EvaluateMeshOptions& options) {
  line.addText(
      {"--views", "DIR",
       "for completeness, ignore ground truth that is not visible in any view of this TUM folder"},
      options.views_folder);
  line.addNumber({"--samples", "N", "number of samples on each surface"},
                 options.evaluation.samples, {1, 1e9});
  line.add(
      {"--threshold", "M,...", "distances for the F-score in metres (default 0.005,0.01,0.025)"},
      [&](const std::string& text) { options.evaluation.thresholds_m = readNumbers(text); });
  line.add({"--colour", "NAME",
            "compare colours instead of distances, in RGB and CIE Lab over the surface of the "
            "reconstruction; true colours: vertices (those of the ground truth), or checker or "
            "gradient as rendered by render_orbit"},
           [&](const std::string& text) { options.texture = textureFromName(text); });
}

void addOutputOptions(CommandLine& line, EvaluateMeshOptions& options) {
  line.addText(
      {"--picture", "OUT.png",
       "render the reconstruction, coloured by the distance of its vertices from the ground truth"},
      options.picture_path);
  line.addNumber({"--scale-mm", "S", "distance in mm from which vertices are dark red"},
                 options.scale_mm, {1e-6, 1e6});
}

EvaluateMeshOptions readOptions(const std::vector<std::string>& arguments) {
  EvaluateMeshOptions options;
  CommandLine line(
      "evaluate_mesh", "RECONSTRUCTION.ply (GROUNDTRUTH.ply | --topology) [options]",
      "Prints, as JSON: distances from the vertices and from area-uniform samples of the "
      "reconstruction to the ground truth, distances from samples of the ground truth to the "
      "reconstruction (completeness), F-scores and the topology of the mesh. Vertices at the same "
      "position are merged only for border_edges and small_holes.");
  line.addText({"RECONSTRUCTION.ply", "", "the mesh to evaluate"}, options.reconstruction_path);
  line.addText({"GROUNDTRUTH.ply", "", "the true mesh"}, options.ground_truth_path);
  line.addFlag("--topology",
               "print only the topology, for which no true mesh is needed; border_edges are edges "
               "that belong to only one triangle, and small_holes closed loops in connected sets "
               "of 3 to 16 such edges",
               options.topology_only);
  line.requireOneOf({"GROUNDTRUTH.ply", "--topology"});
  addMeasureOptions(line, options);
  addOutputOptions(line, options);
  line.beginGroup("View of the picture");
  addPictureOptions(line, options.picture);
  line.parse(arguments);
  return options;
}

void drawErrors(const EvaluateMeshOptions& options, TriangleMesh reconstruction,
                const TriangleMesh& ground_truth) {
  const std::vector<double> errors_m =
      distancesTo(MeshScene(ground_truth), reconstruction.vertices);
  colourByError(reconstruction, errors_m, 1e-3 * options.scale_mm);
  const MeshScene scene(reconstruction);
  writePicture(options.picture_path, scene, makePictureOptions(options.picture, scene.bounds()));
}

void compareColours(const EvaluateMeshOptions& options) {
  const std::string json = toJson(evaluateColours(readPly(options.reconstruction_path),
                                                  readPly(options.ground_truth_path),
                                                  *options.texture, options.evaluation.samples));
  std::fputs(json.c_str(), stdout);
}

void evaluate(const EvaluateMeshOptions& options) {
  if (options.topology_only) {
    std::fputs(toJson(meshTopology(readPly(options.reconstruction_path))).c_str(), stdout);
    return;
  }
  if (options.texture) return compareColours(options);
  const TriangleMesh reconstruction = readPly(options.reconstruction_path);
  const TriangleMesh ground_truth = readPly(options.ground_truth_path);
  std::optional<Views> views;
  if (!options.views_folder.empty()) views = readViews(options.views_folder);
  const Evaluation figures =
      evaluateMesh(reconstruction, ground_truth, views ? &*views : nullptr, options.evaluation);
  std::fputs(toJson(figures).c_str(), stdout);
  if (!options.picture_path.empty()) drawErrors(options, reconstruction, ground_truth);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("evaluate_mesh", argc, argv, dtsdf::readOptions, dtsdf::evaluate);
}
