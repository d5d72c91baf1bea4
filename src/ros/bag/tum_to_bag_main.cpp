/// tum_to_bag DIR OUT.bag: a TUM RGB-D folder as a bag for rosbag play and `reconstruct --bag`.
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "tum_to_bag.h"

namespace {

constexpr char kUsage[] =
    "usage: tum_to_bag DIR OUT.bag [--depth-scale N] [--millimetres]\n"
    "                  [--map-frame F] [--camera-frame F] [--camera NAMESPACE]\n"
    "\n"
    "Writes NAMESPACE/depth/image_rect and camera_info, NAMESPACE/rgb/image_rect_color (if the\n"
    "folder has colour images) and /tf from the map frame to the camera's optical frame.\n"
    "  --depth-scale N   units per metre of the folder's depth images (5000)\n"
    "  --millimetres     depth as 16UC1 in mm, rounded; without it 32FC1 in m, without loss\n"
    "  --map-frame F     (map)        --camera-frame F  (camera_depth_optical_frame)\n"
    "  --camera NAMESPACE             (/camera)\n";

struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

double parseScale(const std::string& text) {
  char* end = nullptr;
  const double scale = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0') throw UsageError("not a number: '" + text + "'");
  return scale;
}

dtsdf::TumToBagOptions parseArguments(const std::vector<std::string>& arguments) {
  dtsdf::TumToBagOptions options;
  std::vector<std::string> places;
  for (size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const auto value = [&]() -> const std::string& {
      if (i + 1 >= arguments.size()) throw UsageError(argument + " needs a value");
      return arguments[++i];
    };
    if (argument == "--millimetres") options.millimetres = true;
    else if (argument == "--depth-scale") options.units_per_metre = parseScale(value());
    else if (argument == "--map-frame") options.map_frame = value();
    else if (argument == "--camera-frame") options.camera_frame = value();
    else if (argument == "--camera") options.camera_namespace = value();
    else if (argument.rfind("--", 0) == 0) throw UsageError("no such option: " + argument);
    else places.push_back(argument);
  }
  if (places.size() != 2) throw UsageError("give a folder and a bag");
  options.folder = places[0];
  options.bag = places[1];
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 1 && (arguments[0] == "--help" || arguments[0] == "-h")) {
    std::cout << kUsage;
    return 0;
  }
  try {
    const dtsdf::TumToBagOptions options = parseArguments(arguments);
    const dtsdf::TumToBagResult result = dtsdf::convertTumToBag(options);
    std::cout << options.bag << ": " << result.depth_images << " depth images, "
              << result.colour_images << " colour images\n";
    for (const auto& [reason, count] : result.skipped) {
      std::cout << "left out: " << count << " depth images (" << reason << ")\n";
    }
  } catch (const UsageError& error) {
    std::cerr << "tum_to_bag: " << error.what() << "\n" << kUsage;
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "tum_to_bag: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
