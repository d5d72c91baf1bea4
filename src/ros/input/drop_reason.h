/// Why a frame was not fused.
#pragma once

#include <string>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

enum class DropReason {
  kNoCameraInfo,      ///< No camera_info with the image's stamp.
  kNoMask,            ///< No mask with the image's stamp, where there are masks.
  kBadEncoding,       ///< None that images of this kind have.
  kTooLarge,          ///< More pixels than a map takes, or more bytes than may wait.
  kBadImage,          ///< No pixels, or rows and data that do not fit its size.
  kSizeMismatch,      ///< Image and camera_info differ in size.
  kBadIntrinsics,     ///< Focal length not positive, or not finite.
  kNoStamp,           ///< Stamp 0: no transform belongs to it.
  kNoTransform,       ///< None within the timeout.
  kBeforeTransforms,  ///< Older than the transforms known: none can come any more.
  kQueueFull,         ///< The oldest that waited when a newer one came.
  kOutOfOrder,        ///< Older than what another camera's frame has made of the map meanwhile.
  kTimeJump,          ///< In the queue when the stamps jumped back.
  kPoseJump,          ///< The camera would have moved faster than allowed.
  kBadPose,           ///< Not finite, not a rotation, or out of the map's range.
  kNoMeasurement,     ///< No pixel with a depth in range.
  kNoMemory,          ///< On the GPU, for this frame.
  kOverRate,          ///< Left out, as more come than are wanted.
  kNotLevel,          ///< Up is not known yet, and the map is to be level.
  kMisfit,            ///< Does not fit the map, and poses/on_misfit is drop.
  kLost,              ///< The camera is not followed: it does not fit the map, or not yet again.
  kPaused,
  kBackendError,  ///< The map's backend has failed.
};
constexpr int kDropReasonCount = static_cast<int>(DropReason::kBackendError) + 1;

/// In the spelling of the status message: "no_transform".
const char* toString(DropReason reason);

/// The reason for a frame that the mapper did not fuse; `status` is not kFused.
DropReason dropReasonOf(FrameStatus status);

/// What a check has to say against a frame.
struct Rejection {
  DropReason reason;
  std::string text;
};

}  // namespace dtsdf
