/// seen_surface: the part of a mesh that the images of a recording show.

#include "evaluation/seen_surface.h"
#include "program/command_line.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct SeenSurfaceArguments {
  std::string mesh_path, tum_folder, out_path;
  double longest_side_m = 0.02, max_depth_m = 10.0;
};

SeenSurfaceArguments readOptions(const std::vector<std::string>& arguments) {
  SeenSurfaceArguments options;
  CommandLine line("seen_surface", "MESH.ply TUM_DIR OUT.ply [options]",
                   "Writes the part of a mesh that the images of a TUM folder show, cut into small "
                   "triangles. A triangle counts if the centre of a pixel falls on it, at 3 "
                   "degrees or more, and that pixel is one of 2 x 2 that show the same surface.");
  line.addText({"MESH.ply", "", "the true mesh that the images show"}, options.mesh_path);
  line.addText({"TUM_DIR", "", "folder with depth images and poses"}, options.tum_folder);
  line.addText({"OUT.ply", "", "the file to write"}, options.out_path);
  line.addNumber({"--longest-side", "METRES", "longest side of a triangle"}, options.longest_side_m,
                 {1e-3, 1e3});
  line.addNumber({"--max-depth", "METRES", "ignore surfaces farther than this from the camera"},
                 options.max_depth_m, {1e-3, 1e3});
  line.parse(arguments);
  return options;
}

void writeSeenSurface(const SeenSurfaceArguments& options) {
  SeenSurfaceOptions limits;
  limits.longest_side_m = static_cast<float>(options.longest_side_m);
  limits.max_depth_m = static_cast<float>(options.max_depth_m);
  writePly(options.out_path,
           seenSurface(readPly(options.mesh_path), readViews(options.tum_folder), limits));
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("seen_surface", argc, argv, dtsdf::readOptions, dtsdf::writeSeenSurface);
}
