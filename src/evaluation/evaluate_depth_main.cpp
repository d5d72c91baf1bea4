/// evaluate_depth: compares a mesh with depth images, where there is no ground truth.

#include <cstdio>
#include <mutex>

#include "evaluation/depth_comparison.h"
#include "evaluation/parallel.h"
#include "evaluation/view_selection.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct EvaluateDepthOptions {
  std::string mesh_path, tum_folder;
  FrameSelection frames;
  int stride = 2;
};

EvaluateDepthOptions readOptions(const std::vector<std::string>& arguments) {
  EvaluateDepthOptions options;
  CommandLine line("evaluate_depth", "MESH.ply TUM_DIR [options]",
                   "Renders the mesh from the poses of a TUM folder and compares with the measured "
                   "depth: the share of measured pixels where the mesh is, and the differences "
                   "there, as JSON. Meant for frames that the mesh was not made from: reconstruct "
                   "--frames ::2, evaluate_depth --first 1 --step 2.",
                   kExitCodes);
  line.addText({"MESH.ply", "", "the mesh"}, options.mesh_path);
  line.addText({"TUM_DIR", "", "folder with depth images and poses"}, options.tum_folder);
  addSelectionOptions(line, options.frames);
  line.addWhole({"--stride", "N", "every N-th pixel of each row and column"}, options.stride,
                {1, 64});
  line.parse(arguments);
  return options;
}

void evaluateDepth(const EvaluateDepthOptions& options) {
  const MeshScene scene(readPly(options.mesh_path));
  const Views views = readViews(options.tum_folder);
  const std::vector<size_t> chosen = selectViews(options.frames, views.poses_W_C.size());
  DepthComparison comparison(options.stride);
  std::mutex mutex;  // guards `comparison`
  forEachImage(chosen.size(), [&](size_t k) {
    DepthComparison part(options.stride);
    const RenderedView view = renderView(scene, views.camera, views.poses_W_C[chosen[k]]);
    part.add(readTumDepth(views.depth_paths[chosen[k]], views.camera), view.depth_m,
             views.camera);
    const std::lock_guard<std::mutex> lock(mutex);
    comparison.merge(part);
  });
  std::fputs(comparison.toJson().c_str(), stdout);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  using namespace dtsdf;
  return runProgram("evaluate_depth", argc, argv, [](const std::vector<std::string>& arguments) {
    evaluateDepth(readOptions(arguments));
  });
}
