/// render_orbit: renders depth images of a mesh from a trajectory round it into a TUM folder.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>

#include "evaluation/command_line.h"
#include "evaluation/depth_noise.h"
#include "evaluation/parallel.h"
#include "evaluation/progress.h"

namespace dtsdf {
namespace {

constexpr char kUsage[] =
    R"(usage: render_orbit MODEL.ply OUT [options]

Renders depth images of a mesh into the TUM folder OUT (16-bit, 5000 units per metre) and writes the
mesh, as it was placed, to OUT/gt.ply. The defaults are the set-up of the Directional TSDF paper.

  --frames N          number of images (1000)
  --radius M          distance of the camera from the origin in metres (2)
  --trajectory NAME   circle, helix or sphere (circle)
  --longest-side M    size the object is scaled to, centred at the origin (1); 0: left as it is
  --width, --height   image size in pixels (640, 480)
  --focal F           focal length in pixels (525); the principal point is the image's middle
  --noise NAMES       none, kinect (all of the following), or a list of axial, lateral, quantisation
                      and loss with commas (none)
  --seed N            seed of the noise (1)
)";

ViewCamera readCamera(const CommandLine& arguments) {
  ViewCamera camera;
  camera.width = static_cast<int>(arguments.number("width", 640, 2, 4096));
  camera.height = static_cast<int>(arguments.number("height", 480, 2, 4096));
  const float focal_px = static_cast<float>(arguments.number("focal", 525.0, 1.0, 1e5));
  camera.intrinsics = {focal_px, focal_px, 0.5f * static_cast<float>(camera.width - 1),
                       0.5f * static_cast<float>(camera.height - 1)};
  return camera;
}

void renderOrbit(const CommandLine& arguments) {
  const std::string directory = arguments.positional()[1];
  TriangleMesh mesh = readPly(arguments.positional()[0]);
  const double side_m = arguments.number("longest-side", 1.0, 0.0, 1000.0);
  if (side_m > 0.0) centreAndScale(mesh, static_cast<float>(side_m));
  const ViewCamera camera = readCamera(arguments);
  const DepthNoise noise = depthNoiseFromName(arguments.text("noise", "none"));
  const auto seed = static_cast<uint64_t>(arguments.number("seed", 1, 0, 1e9));
  const auto poses_W_C = orbitPoses(orbitShapeFromName(arguments.text("trajectory", "circle")),
                                    static_cast<size_t>(arguments.number("frames", 1000, 1, 1e6)),
                                    arguments.number("radius", 2.0, 0.01, 1000.0));

  const MeshScene scene(mesh);
  const TumWriter writer(directory, camera, poses_W_C);
  writePly(directory + "/gt.ply", mesh);
  const auto renderFrames = [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const RenderedView view = renderView(scene, camera, poses_W_C[i]);
      const uint64_t frame_seed = seed << 32 | i;
      writer.write(i, toTumDepth(addNoise(view, camera, noise, frame_seed)));
    }
  };
  parallelFor(poses_W_C.size(), 1, renderFrames, terminalProgress("rendering", poses_W_C.size()));
  writer.finish(std::filesystem::path(arguments.positional()[0]).stem().string());
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  try {
    const dtsdf::CommandLine arguments(argc, argv,
                                       {"frames", "radius", "trajectory", "longest-side", "width",
                                        "height", "focal", "noise", "seed"},
                                       {"help"});
    if (arguments.has("help") || arguments.positional().size() != 2) {
      std::fputs(dtsdf::kUsage, arguments.has("help") ? stdout : stderr);
      return arguments.has("help") ? 0 : 2;
    }
    dtsdf::renderOrbit(arguments);
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "render_orbit: %s (see --help)\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "render_orbit: %s\n", error.what());
    return 1;
  }
}
