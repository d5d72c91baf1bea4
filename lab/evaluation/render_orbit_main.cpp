/// render_orbit: renders images of a mesh along a trajectory around it, into a TUM folder.

#include <filesystem>
#include <optional>
#include <stdexcept>

#include "evaluation/depth_noise.h"
#include "evaluation/hand_path.h"
#include "program/command_line.h"
#include "program/run_program.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

struct RenderOrbitOptions {
  std::string model_path, folder;
  size_t frames = 1000;
  double radius_m = 2.0;
  OrbitShape trajectory = OrbitShape::kCircle;
  double longest_side_m = 1.0;  ///< 0: the model is not scaled.
  std::string views_folder;  ///< Folder with poses to use instead of the trajectory; empty: none.
  int width = 640, height = 480;
  double focal_px = 525.0;
  DepthNoise noise = DepthNoise::kNone;
  uint64_t seed = 1;
  std::optional<Texture> texture;  ///< Texture of colour images; none: no colour images.
};

void addSceneOptions(CommandLine& line, RenderOrbitOptions& options) {
  line.addNumber({"--frames", "N", "number of images"}, options.frames, {1, 1e6});
  line.addNumber({"--radius", "METRES", "distance of the camera from the origin"}, options.radius_m,
                 {0.01, 1000.0});
  line.add({"--trajectory", "NAME",
            "circle, helix, sphere or hand (default circle); hand: a hand-held camera is carried "
            "around the circle, or through the poses of --views"},
           [&](const std::string& text) { options.trajectory = orbitShapeFromName(text); });
  line.addNumber({"--longest-side", "METRES",
                  "move the object to the origin and scale its longest side to this length; 0: "
                  "leave it as it is"},
                 options.longest_side_m, {0.0, 1000.0});
  line.addText(
      {"--views", "DIR",
       "use poses from a TUM folder instead of a trajectory: at most --frames of them, evenly "
       "chosen, or all of them with --trajectory hand; the mesh is not moved or scaled"},
      options.views_folder);
}

void addCameraOptions(CommandLine& line, RenderOrbitOptions& options) {
  line.addNumber({"--width", "PIXELS", "width of the images"}, options.width, {2, 4096});
  line.addNumber({"--height", "PIXELS", "height of the images"}, options.height, {2, 4096});
  line.addNumber({"--focal", "PIXELS", "focal length; the principal point is the image centre"},
                 options.focal_px, {1.0, 1e5});
  line.add({"--noise", "NAME", "noise model: none, kinect, tof or stereo (default none)"},
           [&](const std::string& text) { options.noise = depthNoiseFromName(text); });
  line.addNumber({"--seed", "N", "random seed for the noise and the hand-held path"}, options.seed,
                 {0, 1e9});
}

void addColourOptions(CommandLine& line, RenderOrbitOptions& options) {
  line.add({"--colour", "NAME",
            "also render colour images, half a period after each depth image: vertices (the "
            "colours of the mesh), checker (50 mm cubes) or gradient (waves of 0.4 m)"},
           [&](const std::string& text) { options.texture = textureFromName(text); });
}

RenderOrbitOptions readOptions(const std::vector<std::string>& arguments) {
  RenderOrbitOptions options;
  CommandLine line("render_orbit", "MODEL.ply OUT [options]",
                   "Renders depth images of a mesh into the TUM folder OUT (16-bit, 5000 units per "
                   "metre) and writes the mesh as rendered to OUT/gt.ply. The defaults are the "
                   "set-up in the Directional TSDF paper.");
  line.addText({"MODEL.ply", "", "the mesh"}, options.model_path);
  line.addText({"OUT", "", "the folder"}, options.folder);
  addSceneOptions(line, options);
  addCameraOptions(line, options);
  addColourOptions(line, options);
  line.parse(arguments);
  return options;
}

/// Poses and rate of the images.
struct CameraPath {
  std::vector<Eigen::Isometry3d> depth_W_C, colour_W_C;
  double rate_hz;
};

std::vector<Eigen::Isometry3d> everyNth(const std::vector<Eigen::Isometry3d>& all, size_t first,
                                        size_t step) {
  std::vector<Eigen::Isometry3d> poses_W_C;
  for (size_t i = first; i < all.size(); i += step) poses_W_C.push_back(all[i]);
  return poses_W_C;
}

/// A hand-held path. Each colour image is taken half a period after its depth image, from the pose
/// at that time.
CameraPath handPath(const RenderOrbitOptions& options) {
  constexpr double kRate_hz = 30.0;
  constexpr size_t kPosesOfCircle = 40;
  const std::vector<Eigen::Isometry3d> through_W_C =
      options.views_folder.empty()
          ? orbitPoses(OrbitShape::kCircle, kPosesOfCircle, options.radius_m)
          : readViews(options.views_folder).poses_W_C;
  const auto poses_W_C = handPoses(through_W_C, {2 * options.frames, 2.0 * kRate_hz, options.seed});
  return {everyNth(poses_W_C, 0, 2), everyNth(poses_W_C, 1, 2), kRate_hz};
}

CameraPath pathOf(const RenderOrbitOptions& options) {
  constexpr double kRate_hz = 10.0;
  if (options.trajectory == OrbitShape::kHand) return handPath(options);
  std::vector<Eigen::Isometry3d> poses_W_C;
  if (options.views_folder.empty()) {
    poses_W_C = orbitPoses(options.trajectory, options.frames, options.radius_m);
  } else {
    const auto all_W_C = readViews(options.views_folder).poses_W_C;
    poses_W_C = everyNth(all_W_C, 0, (all_W_C.size() + options.frames - 1) / options.frames);
  }
  return {poses_W_C, poses_W_C, kRate_hz};
}

void renderOrbit(const RenderOrbitOptions& options) {
  TriangleMesh mesh = readPly(options.model_path);
  if (options.longest_side_m > 0.0 && options.views_folder.empty()) {
    centreAndScale(mesh, static_cast<float>(options.longest_side_m));
  }
  const ViewCamera camera = centredCamera(options.width, options.height, options.focal_px);
  const CameraPath path = pathOf(options);
  const auto& poses_W_C = path.depth_W_C;

  if (options.texture == Texture::kVertices && mesh.colours.empty()) {
    throw std::runtime_error(options.model_path + " has no colours; use checker or gradient");
  }

  const MeshScene scene(mesh);
  std::vector<Eigen::Isometry3d> colour_poses_W_C;
  if (options.texture) colour_poses_W_C = path.colour_W_C;
  for (Eigen::Isometry3d& T_W_C : colour_poses_W_C) {
    T_W_C.translate(Eigen::Vector3d(0.05, 0.0, 0.0));  // the colour camera is to the right
  }
  const TumWriter writer(options.folder, camera, poses_W_C, path.rate_hz, colour_poses_W_C);
  writePly(options.folder + "/gt.ply", mesh);
  parallelFor(poses_W_C.size(), 0, [&](size_t i) {
    const DepthView view = renderView(scene, camera, poses_W_C[i]);
    const uint64_t frame_seed = options.seed << 32 | i;
    writer.write(i, toTumDepth(addNoise(view, camera, options.noise, frame_seed)));
    if (options.texture) {
      writer.writeColours(i, renderColours(scene, *options.texture, camera, colour_poses_W_C[i]));
    }
  });
  writer.finish(std::filesystem::path(options.model_path).stem().string());
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("render_orbit", argc, argv, dtsdf::readOptions, dtsdf::renderOrbit);
}
