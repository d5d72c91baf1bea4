// Replaces src/ros/bag in builds without ROS.
#include <stdexcept>

#include "io/bag_frames.h"

namespace dtsdf {

std::unique_ptr<FrameSource> openBagFrames(const BagOptions&) {
  throw std::runtime_error("this build cannot read bags; build the package with -DWITH_ROS=ON");
}

std::unique_ptr<ColourSource> openBagColours(const BagOptions&) { return nullptr; }

Eigen::Vector3d findUpInBag(const BagOptions& options) {
  openBagFrames(options);  // throws
  return {};
}

}  // namespace dtsdf
