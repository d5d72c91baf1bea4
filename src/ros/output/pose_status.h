/// From how depth images fit the map to the status message.
#pragma once

#include <dtsdf_mapping/PoseStatus.h>

#include "ros/output/pose_report.h"

namespace dtsdf {

dtsdf_mapping::PoseStatus makePoseStatus(const CameraPoseReport& report);

}  // namespace dtsdf
