/// evaluate_trail: how much of a moved object is left in a mesh.

#include <cstdio>
#include <nlohmann/json.hpp>

#include "evaluation/moving_object_options.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct EvaluateTrailOptions {
  std::string mesh_path, reference_path;
  MovingObject object;
  double margin_m = 0.0, distance_m = 0.05;
  size_t samples = 2000000;
};

EvaluateTrailOptions readOptions(const std::vector<std::string>& arguments) {
  EvaluateTrailOptions options;
  CommandLine line("evaluate_trail", "MESH.ply REFERENCE.ply --from X,Y,Z --to X,Y,Z [options]",
                   "Measures what a mesh keeps of an object that insert_object put into its "
                   "recording: the area within the volume that the object passed through, and how "
                   "much of it is far from the mesh of the recording without the object, as JSON.",
                   kExitCodes);
  line.addText({"MESH.ply", "", "the mesh"}, options.mesh_path);
  line.addText({"REFERENCE.ply", "", "the mesh without the object"}, options.reference_path);
  addObjectOptions(line, options.object);
  line.addNumber({"--margin", "METRES", "added to the volume on all sides"}, options.margin_m,
                 {0.0, 1.0});
  line.addNumber({"--distance", "METRES", "what is nearer to the reference is no trail"},
                 options.distance_m, {0.0, 10.0});
  line.addWhole({"--samples", "N", "points of the mesh to look at"}, options.samples, {1000, 1e8});
  line.parse(arguments);
  return options;
}

void evaluateTrail(const EvaluateTrailOptions& options) {
  const TrailArea area =
      trailArea(readPly(options.mesh_path), readPly(options.reference_path), options.object,
                options.margin_m, options.distance_m, options.samples);
  const nlohmann::json json = {{"swept_cm2", 1e4 * area.swept_m2},
                               {"trail_cm2", 1e4 * area.trail_m2}};
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  using namespace dtsdf;
  return runProgram("evaluate_trail", argc, argv, [](const std::vector<std::string>& arguments) {
    evaluateTrail(readOptions(arguments));
  });
}
