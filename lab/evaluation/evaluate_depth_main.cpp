/// evaluate_depth: compares a mesh with depth images, for recordings without ground truth.

#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>

#include "dtsdf_mapping/io/frame_source.h"
#include "evaluation/depth_comparison.h"
#include "evaluation/depth_registration.h"
#include "program/command_line.h"
#include "program/run_program.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

struct EvaluateDepthOptions {
  std::string mesh_path, tum_folder;
  FrameSelection frames;
  int stride = 2;
  int registration_steps = 0;
};

EvaluateDepthOptions readOptions(const std::vector<std::string>& arguments) {
  EvaluateDepthOptions options;
  CommandLine line("evaluate_depth", "MESH.ply TUM_DIR [options]",
                   "Renders a mesh from the poses in a TUM folder and compares it with the "
                   "measured depth. Prints, as JSON, the fraction of measured pixels that the mesh "
                   "covers, and the differences there. Use frames that were not used to build the "
                   "mesh: reconstruct --frames ::2, evaluate_depth --first 1 --step 2.");
  line.addText({"MESH.ply", "", "the mesh"}, options.mesh_path);
  line.addText({"TUM_DIR", "", "folder with depth images and poses"}, options.tum_folder);
  line.addNumber({"--first", "N", "first image to use"}, options.frames.first, {0, kUnbounded});
  line.addNumber({"--step", "N", "step from one image to the next"}, options.frames.step,
                 {1, kUnbounded});
  line.addNumber({"--stride", "N", "use every N-th pixel of each row and column"}, options.stride,
                 {1, 64});
  line.addNumber({"--register", "N",
                  "also print the metrics after aligning each image with the mesh in N steps; 0: "
                  "do not align"},
                 options.registration_steps, {0, 100});
  line.parse(arguments);
  return options;
}

/// Indices of the selected images, out of `count`.
std::vector<size_t> selectViews(const FrameSelection& frames, size_t count) {
  std::vector<size_t> chosen;
  for (size_t i = frames.first; i < count; i += frames.step) {
    chosen.push_back(i);
  }
  if (chosen.empty())
    throw UsageError("--first: only " + std::to_string(count) + " images have a pose");
  return chosen;
}

/// Comparisons at the recorded poses, and after aligning each image with the mesh.
struct Results {
  explicit Results(int stride) : recorded(stride), registered(stride) {}

  DepthComparison recorded, registered;
};

Results compare(const EvaluateDepthOptions& options, const MeshScene& scene, const Views& views,
                const std::vector<size_t>& chosen) {
  Results results(options.stride);
  std::mutex mutex;  // guards the results
  parallelFor(chosen.size(), 0, [&](size_t k) {
    const ViewCamera& camera = views.camera;
    const Eigen::Isometry3d& T_W_C = views.poses_W_C[chosen[k]];
    const std::vector<float> depth_m = readTumDepth(views.depth_paths[chosen[k]], camera);
    Results part(options.stride);
    part.recorded.add(depth_m, renderView(scene, camera, T_W_C).depth_m, camera);
    if (options.registration_steps > 0) {
      const Eigen::Isometry3d found =
          registerDepth(scene, camera, depth_m, T_W_C, options.registration_steps);
      part.registered.add(depth_m, renderView(scene, camera, found).depth_m, camera);
    }
    const std::lock_guard<std::mutex> lock(mutex);
    results.recorded.merge(part.recorded);
    results.registered.merge(part.registered);
  });
  return results;
}

void evaluateDepth(const EvaluateDepthOptions& options) {
  const MeshScene scene(readPly(options.mesh_path));
  const Views views = readViews(options.tum_folder);
  const std::vector<size_t> chosen = selectViews(options.frames, views.poses_W_C.size());
  const Results results = compare(options, scene, views, chosen);
  nlohmann::json json = nlohmann::json::parse(results.recorded.toJson());
  if (options.registration_steps > 0) {
    json["registered"] = nlohmann::json::parse(results.registered.toJson());
  }
  std::puts(json.dump(2).c_str());
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("evaluate_depth", argc, argv, dtsdf::readOptions, dtsdf::evaluateDepth);
}
