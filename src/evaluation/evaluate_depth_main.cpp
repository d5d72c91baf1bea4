/// evaluate_depth: compares a mesh with depth images, where there is no ground truth.

#include <cstdio>
#include <exception>
#include <mutex>
#include <stdexcept>

#include "evaluation/command_line.h"
#include "evaluation/depth_comparison.h"
#include "evaluation/parallel.h"
#include "evaluation/progress.h"

namespace dtsdf {
namespace {

constexpr char kUsage[] =
    R"(usage: evaluate_depth MESH.ply TUM_DIR [options]

Renders the mesh from the poses of a TUM folder and compares with the measured depth: the share of
measured pixels where the mesh is, and the differences there. Meant for frames that the mesh was not
made from: reconstruct --frames ::2, evaluate_depth --first 1 --step 2.

  --first N, --last N, --step N   which images (0, all, 1)
  --stride N                      every N-th pixel of each row and column (2)
)";

void evaluateDepth(const CommandLine& arguments) {
  constexpr double kMany = 1e9;
  const MeshScene scene(readPly(arguments.positional()[0]));
  const Views views = readViews(arguments.positional()[1]);
  const auto first = static_cast<size_t>(arguments.number("first", 0, 0, kMany));
  const auto last = static_cast<size_t>(arguments.number("last", kMany, 0, kMany));
  const auto step = static_cast<size_t>(arguments.number("step", 1, 1, kMany));
  std::vector<size_t> chosen;
  for (size_t i = first; i < views.poses_W_C.size() && i <= last; i += step) chosen.push_back(i);
  if (chosen.empty()) throw std::invalid_argument("no image is chosen");

  const int stride = static_cast<int>(arguments.number("stride", 2, 1, 64));
  DepthComparison comparison(stride);
  std::mutex mutex;  // guards `comparison`
  const auto compare = [&](size_t begin, size_t end) {
    DepthComparison part(stride);
    for (size_t k = begin; k < end; ++k) {
      const RenderedView view = renderView(scene, views.camera, views.poses_W_C[chosen[k]]);
      part.add(readTumDepth(views.depth_paths[chosen[k]], views.camera), view.depth_m,
               views.camera);
    }
    const std::lock_guard<std::mutex> lock(mutex);
    comparison.merge(part);
  };
  parallelFor(chosen.size(), 1, compare, terminalProgress("images", chosen.size()));
  std::fputs(comparison.toJson().c_str(), stdout);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  try {
    const dtsdf::CommandLine arguments(argc, argv, {"first", "last", "step", "stride"}, {"help"});
    if (arguments.has("help") || arguments.positional().size() != 2) {
      std::fputs(dtsdf::kUsage, arguments.has("help") ? stdout : stderr);
      return arguments.has("help") ? 0 : 2;
    }
    dtsdf::evaluateDepth(arguments);
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "evaluate_depth: %s (see --help)\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "evaluate_depth: %s\n", error.what());
    return 1;
  }
}
