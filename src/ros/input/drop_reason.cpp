#include "ros/input/drop_reason.h"

namespace dtsdf {

const char* toString(DropReason reason) {
  switch (reason) {
    case DropReason::kNoCameraInfo: return "no_camera_info";
    case DropReason::kNoMask: return "no_mask";
    case DropReason::kBadEncoding: return "bad_encoding";
    case DropReason::kTooLarge: return "too_large";
    case DropReason::kBadImage: return "bad_image";
    case DropReason::kSizeMismatch: return "size_mismatch";
    case DropReason::kBadIntrinsics: return "bad_intrinsics";
    case DropReason::kNoStamp: return "no_stamp";
    case DropReason::kNoTransform: return "no_transform";
    case DropReason::kBeforeTransforms: return "before_transforms";
    case DropReason::kQueueFull: return "queue_full";
    case DropReason::kOutOfOrder: return "out_of_order";
    case DropReason::kTimeJump: return "time_jump";
    case DropReason::kPoseJump: return "pose_jump";
    case DropReason::kBadPose: return "bad_pose";
    case DropReason::kNoMeasurement: return "no_measurement";
    case DropReason::kNoMemory: return "no_memory";
    case DropReason::kOverRate: return "over_rate";
    case DropReason::kNotLevel: return "not_level";
    case DropReason::kMisfit: return "misfit";
    case DropReason::kLost: return "lost";
    case DropReason::kPaused: return "paused";
    case DropReason::kBackendError: return "backend_error";
  }
  return "unknown";
}

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

}  // namespace dtsdf
