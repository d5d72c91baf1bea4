/// evaluate_trail: how much of a moved object is left in a mesh.

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "evaluation/shared_options.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct EvaluateTrailOptions {
  std::string mesh_path, reference_path;
  MovingObject object;
  TrailRule rule;
  std::string views_folder;
  FrameSelection frames;
  size_t least_images = 5;
};

EvaluateTrailOptions readOptions(const std::vector<std::string>& arguments) {
  EvaluateTrailOptions options;
  CommandLine line("evaluate_trail", "MESH.ply REFERENCE.ply --from X,Y,Z --to X,Y,Z [options]",
                   "Measures what a mesh keeps of an object that insert_object put into its "
                   "recording: the area within the volume that the object passed through, and how "
                   "much of it is far from the mesh of the recording without the object, as JSON.");
  line.addText({"MESH.ply", "", "the mesh"}, options.mesh_path);
  line.addText({"REFERENCE.ply", "", "the mesh without the object"}, options.reference_path);
  addObjectOptions(line, options.object);
  line.addNumber({"--margin", "METRES", "added to the volume on all sides"}, options.rule.margin_m,
                 {0.0, 1.0});
  line.addNumber({"--distance", "METRES",
                  "surface nearer than this to the reference does not count as "
                  "trail"},
                 options.rule.distance_m, {0.0, 10.0});
  line.addWhole({"--samples", "N", "number of points of the mesh to check"}, options.rule.samples,
                {1000, 1e8});
  line.addText({"--views", "TUM_DIR",
                "also print the trail that these images see through, because they measured "
                "something behind it"},
               options.views_folder);
  addSelectionOptions(line, options.frames);
  line.addWhole({"--least-images", "N", "how many of these images must see through it"},
                options.least_images, {1, 1e6});
  for (const char* name : {"--first", "--last", "--step", "--least-images"}) {
    line.onlyWith(name, "--views");
  }
  line.parse(arguments);
  return options;
}

/// Area of what enough images of the recording see through.
double seenThrough(const Trail& trail, const EvaluateTrailOptions& options) {
  const Views views = readViews(options.views_folder);
  const std::vector<size_t> counts =
      countSeenThrough(trail.points, views, selectViews(options.frames, views.poses_W_C.size()),
                       options.rule.distance_m);
  const auto seen = std::count_if(counts.begin(), counts.end(),
                                  [&](size_t count) { return count >= options.least_images; });
  return trail.sample_m2 * static_cast<double>(seen);
}

void evaluateTrail(const EvaluateTrailOptions& options) {
  const Trail trail = findTrail(readPly(options.mesh_path), readPly(options.reference_path),
                                options.object, options.rule);
  constexpr double kCm2 = 1e4;
  const double sample_cm2 = kCm2 * trail.sample_m2;
  nlohmann::json json = {{"swept_cm2", sample_cm2 * static_cast<double>(trail.swept)},
                         {"trail_cm2", sample_cm2 * static_cast<double>(trail.points.size())}};
  if (!options.views_folder.empty()) json["seen_through_cm2"] = kCm2 * seenThrough(trail, options);
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("evaluate_trail", argc, argv, dtsdf::readOptions, dtsdf::evaluateTrail);
}
