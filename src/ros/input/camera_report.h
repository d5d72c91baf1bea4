/// What is reported about the cameras while the node runs.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "ros/input/frame_accounting.h"

namespace dtsdf {

/// Of one kind of images of one camera.
struct StreamReport {
  FrameCounts frames;
  std::string image_topic, info_topic;
  size_t image_publishers = 0;
  size_t waiting = 0;        ///< For their camera_info, transform or turn, or in work.
  size_t waiting_bytes = 0;  ///< What these keep in memory.
  std::string waiting_for;   ///< What the first of them waits for.
  std::string warning;       ///< What is wrong with all of them, fused or not.
};

struct CameraReport {
  std::string name;  ///< Empty for the only one, in the node's own namespace.
  StreamReport depth;
  std::optional<StreamReport> colour;  ///< Where colour is wanted.
  bool is_colour_needed = false;       ///< It is amiss if there is none.
};

}  // namespace dtsdf
