#include "evaluation/shared_options.h"

#include <stdexcept>

#include "simulation/scene.h"

namespace dtsdf {
namespace {

Eigen::Vector3d readPoint(const std::string& text) {
  const std::vector<double> numbers = readNumbers(text);
  if (numbers.size() != 3) throw UsageError("'" + text + "' is not of the form X,Y,Z");
  return {numbers[0], numbers[1], numbers[2]};
}

void addViewOptions(CommandLine& line, PictureRequest& request) {
  line.add({"--view", "AZ,EL",
            "azimuth and elevation in degrees from which the whole mesh is viewed, with y up "
            "(default 30,20)"},
           [&](const std::string& text) {
             const std::vector<double> angles = readNumbers(text);
             if (angles.size() != 2) throw UsageError("'" + text + "' is not of the form AZ,EL");
             request.azimuth_deg = angles[0];
             request.elevation_deg = angles[1];
           });
  line.add({"--eye", "X,Y,Z", "position of the camera in metres, instead of --view"},
           [&](const std::string& text) { request.eye = readPoint(text); });
  line.add({"--target", "X,Y,Z", "point in metres that a camera at --eye faces"},
           [&](const std::string& text) { request.target = readPoint(text); });
  line.onlyWith("--eye", "--target");
  line.onlyWith("--target", "--eye");
}

}  // namespace

void addPictureOptions(CommandLine& line, PictureRequest& request) {
  addViewOptions(line, request);
  line.addNumber({"--width", "PIXELS", "width of the picture"}, request.width, {64, 8192});
  line.addNumber({"--height", "PIXELS", "height of the picture"}, request.height, {64, 8192});
  line.addNumber({"--focal", "PIXELS", "focal length (default: 1.2 times the width)"},
                 request.focal_px, {1.0, 1e5});
}

PictureOptions makePictureOptions(const PictureRequest& request,
                                  const Eigen::AlignedBox3f& bounds) {
  PictureOptions options;
  options.camera =
      centredCamera(request.width, request.height, request.focal_px.value_or(1.2 * request.width));
  if (request.eye && request.target) {
    options.T_W_C = lookAt(*request.eye, *request.target, Eigen::Vector3d::UnitY());
  } else {
    options.T_W_C = framingPose(bounds, options.camera, request.azimuth_deg, request.elevation_deg);
  }
  return options;
}

}  // namespace dtsdf
