/// Says in words how mapping goes: whether all is well, and if not, what is amiss, above all why
/// there is no mesh when there is none, and what to do.
#pragma once

#include <dtsdf_mapping/MapStatus.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "log/log_queue.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/published_topics.h"
#include "ros/input/transforms.h"
#include "ros/output/reports.h"
#include "ros/output/status_history.h"

namespace dtsdf {

/// Everything the status is made from, at one moment.
struct StatusInput {
  std::vector<CameraReport> cameras;
  std::vector<DropShare> recent_drops;  ///< Of each; may be empty.
  MapReport map;
  OutputReport output;
  TransformReport transforms;
  PoseReport poses;
  LogReport log;
  CorrectionReport correction;
  bool paused = false;
  bool time_stands = false;      ///< Simulated time does.
  double ran_s = 0.0;            ///< How long neither: see RunClock.
  double stale_s = 0.0;          ///< The setting; 0: silence is no fault.
  std::string master;            ///< What is wrong with the registration there; empty: nothing.
  PublishedTopics topics;        ///< That there are, while one of a camera's own is missing.
  uint64_t process_bytes = 0;    ///< Resident memory of the whole process; 0: not known.
  uint64_t max_image_bytes = 0;  ///< That may wait, of one kind of images of one camera.
  uint64_t max_queue_bytes = 0;  ///< Of messages of the mesh, for listeners.
};

/// Whether the camera's depth images or their camera_info have not come.
bool lacksInput(const CameraReport& camera);

/// `before` is the last status, which shows what is new; empty for the first one.
dtsdf_mapping::MapStatus makeStatus(const StatusInput& input,
                                    const dtsdf_mapping::MapStatus& before = {});

/// A level of MapStatus, and the sentence for it. Names from outside are in it as they came.
using Verdict = std::pair<uint8_t, std::string>;

/// Whether all is well, and if not, what is amiss and what to do. `before` as above.
Verdict judge(const StatusInput& in, const dtsdf_mapping::MapStatus& before);

}  // namespace dtsdf
