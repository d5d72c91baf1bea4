/// render_mesh: renders a shaded picture of a mesh from a given viewpoint.

#include "evaluation/shared_options.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct RenderMeshOptions {
  std::string mesh_path, picture_path;
  PictureRequest picture;
  std::string views_folder;  ///< Empty: the view is given by `picture`.
  size_t image = 0;
  bool plain = false;
};

RenderMeshOptions readOptions(const std::vector<std::string>& arguments) {
  RenderMeshOptions options;
  CommandLine line("render_mesh", "MESH.ply OUT.png [options]",
                   "Renders a shaded picture of a mesh, in its own colours if it has any. The "
                   "backs of triangles are brown.");
  line.addText({"MESH.ply", "", "the mesh"}, options.mesh_path);
  line.addText({"OUT.png", "", "the picture"}, options.picture_path);
  line.addFlag("--plain", "ignore the colours of the mesh", options.plain);
  addPictureOptions(line, options.picture);
  line.addText({"--views", "DIR", "render from the pose of a depth image in this TUM folder"},
               options.views_folder);
  line.addNumber({"--image", "N", "index of that image among the images with a pose"},
                 options.image, {0, kUnbounded});
  line.onlyWith("--image", "--views");
  line.parse(arguments);
  return options;
}

/// Sets the camera and pose of the picture to those of an image.
void viewFrom(const std::string& folder, size_t image, PictureOptions& picture) {
  const Views views = readViews(folder);
  if (image >= views.poses_W_C.size()) {
    throw UsageError("--image: only " + std::to_string(views.poses_W_C.size()) + " have a pose");
  }
  picture.camera = views.camera;
  picture.T_W_C = views.poses_W_C[image];
}

void renderMesh(const RenderMeshOptions& options) {
  const MeshScene scene(readPly(options.mesh_path));
  PictureOptions picture = makePictureOptions(options.picture, scene.bounds());
  if (!options.views_folder.empty()) viewFrom(options.views_folder, options.image, picture);
  picture.own_colours = !options.plain;
  writePicture(options.picture_path, scene, picture);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("render_mesh", argc, argv, dtsdf::readOptions, dtsdf::renderMesh);
}
