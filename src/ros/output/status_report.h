/// Says in words how mapping goes, above all why there is no mesh when there is none.
#pragma once

#include <dtsdf_mapping/MapStatus.h>

#include <string>
#include <vector>

#include "ros/input/frame_accounting.h"
#include "ros/output/map_report.h"

namespace dtsdf {

/// Everything the status is made from, at one moment.
struct StatusInput {
  FrameCounts frames;
  MapReport map;
  OutputReport output;
  bool paused = false;
  size_t frames_waiting = 0;
  std::string waiting_for;  ///< What the first frame in the queue waits for.
  std::string image_topic, info_topic;
  size_t image_publishers = 0;
  std::vector<std::string> depth_topics;  ///< That there are, while the image's own has nobody.
  size_t mesh_listeners = 0;
  uint64_t newly_dropped = 0;  ///< Frames dropped since the last status.
  uint64_t newly_fused = 0;
  uint64_t max_map_bytes = 0;
};

dtsdf_mapping::MapStatus makeStatus(const StatusInput& input);

}  // namespace dtsdf
