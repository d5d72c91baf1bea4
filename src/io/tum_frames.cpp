#include "dtsdf_mapping/io/tum_frames.h"

#include "dtsdf_mapping/io/recording.h"

namespace dtsdf {

std::unique_ptr<FrameSource> openTumFrames(const TumOptions& options) {
  RecordingOptions recording;
  recording.path = options.folder;
  recording.format = "tum";
  recording.units_per_metre = options.units_per_metre;
  recording.pose_tolerance_s = options.pose_tolerance_s;
  recording.selection = options.selection;
  return openRecording(recording);
}

}  // namespace dtsdf
