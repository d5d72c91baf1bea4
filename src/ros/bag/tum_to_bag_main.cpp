/// tum_to_bag DIR OUT.bag: a TUM RGB-D folder as a bag for rosbag play and `reconstruct --bag`.
#include <iostream>

#include "program/command_line.h"
#include "program/run_program.h"
#include "tum_to_bag.h"

namespace dtsdf {
namespace {

TumToBagOptions readOptions(const std::vector<std::string>& arguments) {
  TumToBagOptions options;
  CommandLine line("tum_to_bag", "DIR OUT.bag [options]",
                   "Writes a bag with NAMESPACE/depth/image_rect and camera_info, "
                   "NAMESPACE/rgb/image_rect_color and camera_info (if the folder has colour "
                   "images), and /tf from the map frame to the camera's optical frame.",
                   kExitCodes);
  line.addText({"DIR", "", "the folder"}, options.folder);
  line.addText({"OUT.bag", "", "the bag"}, options.bag);
  line.addNumber({"--depth-scale", "UNITS", "units per metre of the folder's depth images"},
                 options.units_per_metre, {kAboveZero, kUnbounded});
  line.addFlag("--millimetres", "depth as 16UC1 in mm, rounded (default: 32FC1 in m, lossless)",
               options.millimetres);
  line.addText({"--map-frame", "FRAME", "frame of the map"}, options.map_frame);
  line.addText({"--camera-frame", "FRAME", "the camera's optical frame"}, options.camera_frame);
  line.addText({"--camera", "NAMESPACE", "namespace of the topics"}, options.camera_namespace);
  line.parse(arguments);
  return options;
}

void convert(const TumToBagOptions& options) {
  const TumToBagResult result = convertTumToBag(options);
  std::cout << options.bag << ": " << result.depth_images << " depth images, "
            << result.colour_images << " colour images\n";
  for (const auto& [reason, count] : result.skipped) {
    std::cout << "left out: " << count << " depth images (" << reason << ")\n";
  }
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  using namespace dtsdf;
  return runProgram("tum_to_bag", argc, argv, [](const std::vector<std::string>& arguments) {
    convert(readOptions(arguments));
  });
}
