#include "ros/input/frame_accounting.h"

#include <numeric>

namespace dtsdf {

namespace {

struct ReasonTexts {
  const char* name;
  bool is_fault;
  const char* remedy = "";
};

/// In the order of DropReason.
constexpr ReasonTexts kReasons[kDropReasonCount] = {
    {"no_camera_info", true},
    {"no_mask", true},
    {"bad_encoding", true},
    {"too_large", true, "lower the camera's resolution"},
    {"unorganised", true},
    {"bad_image", true},
    {"size_mismatch", true},
    {"bad_intrinsics", true},
    {"no_stamp", true},
    {"bad_stamp", true},
    {"repeated_stamp", true},
    {"long_name", true},
    {"no_transform", true, "raise input/tf_timeout_s, or check what publishes the poses"},
    {"before_transforms", false},
    {"queue_full", true, "use larger voxels (map/voxel_size_m), a GPU, or fewer frames"},
    {"out_of_order", true, "raise input/merge_wait_s"},
    {"time_jump", false},
    {"pose_jump", true, "check the pose estimate, or raise input/max_speed_m_s"},
    {"bad_pose", true, "check the pose estimate, or raise input/max_speed_m_s"},
    {"no_measurement", true},
    {"no_memory", true},
    {"over_rate", false},
    {"not_level", false},  // until the first frame is fused, and the status says so then
    {"misfit", true, "check the pose estimate, or raise poses/sigma_m and poses/sigma_rad"},
    {"lost", true, "move the camera back to where it was, and then more slowly; or call set_pose"},
    {"paused", false},
    {"ending", false},
    {"backend_error", true},
};

const ReasonTexts& textsOf(DropReason reason) { return kReasons[static_cast<size_t>(reason)]; }

}  // namespace

const char* toString(DropReason reason) { return textsOf(reason).name; }

const char* remedyFor(DropReason reason) { return textsOf(reason).remedy; }

bool isFault(DropReason reason) { return textsOf(reason).is_fault; }

DropReason dropReasonOf(FrameStatus status) {
  switch (status) {
    case FrameStatus::kBadIntrinsics: return DropReason::kBadIntrinsics;
    case FrameStatus::kBadPose: return DropReason::kBadPose;
    case FrameStatus::kNoMeasurement: return DropReason::kNoMeasurement;
    case FrameStatus::kNoMemory: return DropReason::kNoMemory;
    case FrameStatus::kBadImage:
    case FrameStatus::kFused: break;
  }
  return DropReason::kBadImage;
}

uint64_t StreamReport::droppedSum() const {
  return std::accumulate(dropped_by.begin(), dropped_by.end(), uint64_t{0});
}

}  // namespace dtsdf
