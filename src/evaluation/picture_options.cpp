#include "evaluation/picture_options.h"

#include <stdexcept>

#include "simulation/scene.h"

namespace dtsdf {

namespace {

Eigen::Vector3d readPoint(const CommandLine& arguments, const std::string& name) {
  const std::vector<double> numbers = arguments.numbers(name, {});
  if (numbers.size() != 3) throw std::invalid_argument("--" + name + " needs x,y,z in metres");
  return {numbers[0], numbers[1], numbers[2]};
}

}  // namespace

std::set<std::string> pictureOptionNames() {
  return {"view", "up", "eye", "target", "width", "height", "focal"};
}

std::string pictureUsage() {
  return R"(  --view AZ,EL       view of the whole mesh from azimuth and elevation in degrees (30,20)
  --up x|y|z         the axis that points up in the picture (y)
  --eye X,Y,Z        view from this point instead, towards --target X,Y,Z
  --width, --height  size of the picture in pixels (1000, 800)
  --focal F          focal length in pixels (1.2 times the width)
)";
}

PictureOptions readPictureOptions(const CommandLine& arguments, const Eigen::AlignedBox3f& bounds) {
  PictureOptions options;
  ViewCamera& camera = options.camera;
  camera.width = static_cast<int>(arguments.number("width", 1000, 64, 8192));
  camera.height = static_cast<int>(arguments.number("height", 800, 64, 8192));
  const double focal_px = arguments.number("focal", 1.2 * camera.width, 1.0, 1e5);
  camera.intrinsics = {static_cast<float>(focal_px), static_cast<float>(focal_px),
                       0.5f * static_cast<float>(camera.width - 1),
                       0.5f * static_cast<float>(camera.height - 1)};
  const std::string up = arguments.text("up", "y");
  if (up != "x" && up != "y" && up != "z") throw std::invalid_argument("--up is x, y or z");
  if (arguments.has("eye")) {
    options.T_W_C = lookAt(readPoint(arguments, "eye"), readPoint(arguments, "target"),
                           Eigen::Vector3d::Unit(up[0] - 'x'));
    return options;
  }
  const std::vector<double> angles = arguments.numbers("view", {30.0, 20.0});
  if (angles.size() != 2) throw std::invalid_argument("--view needs AZIMUTH,ELEVATION");
  options.T_W_C = framingPose(bounds, camera, angles[0], angles[1], up[0]);
  return options;
}

}  // namespace dtsdf
