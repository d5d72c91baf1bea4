/// render_mesh: a shaded picture of a mesh from a given viewpoint.

#include <cstdio>
#include <exception>
#include <stdexcept>

#include "evaluation/picture_options.h"

namespace dtsdf {
namespace {

constexpr char kUsage[] =
    R"(usage: render_mesh MESH.ply OUT.png [options]

Draws a shaded picture of a mesh, with its own colours if it has some. Backs of triangles are brown.

  --plain            leave the mesh's colours out
  --flat             shade triangle by triangle instead of by interpolated normals
)";

void renderMesh(const CommandLine& arguments) {
  const MeshScene scene(readPly(arguments.positional()[0]));
  PictureOptions options = readPictureOptions(arguments, scene.bounds());
  options.smooth = !arguments.has("flat");
  options.own_colours = !arguments.has("plain");
  writePicture(arguments.positional()[1], scene, options);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  try {
    const dtsdf::CommandLine arguments(argc, argv, dtsdf::pictureOptionNames(),
                                       {"help", "plain", "flat"});
    if (arguments.has("help") || arguments.positional().size() != 2) {
      const std::string usage = dtsdf::kUsage + dtsdf::pictureUsage();
      std::fputs(usage.c_str(), arguments.has("help") ? stdout : stderr);
      return arguments.has("help") ? 0 : 2;
    }
    dtsdf::renderMesh(arguments);
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "render_mesh: %s (see --help)\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "render_mesh: %s\n", error.what());
    return 1;
  }
}
