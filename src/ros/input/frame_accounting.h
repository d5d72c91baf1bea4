/// Counts fused frames, and dropped frames by reason, and warns about drops.
#pragma once

#include <dtsdf_mapping/StreamStatus.h>
#include <ros/console.h>
#include <ros/time.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "dtsdf_mapping/mapper.h"
#include "params/printable.h"
#include "ros/common/pace.h"

namespace dtsdf {

struct DropReason {
  const char* name;         ///< Name in the status.
  bool is_fault = true;     ///< Whether drops for this reason are a problem.
  const char* remedy = "";  ///< What to do; empty: see the text of the last drop.

  bool operator==(const DropReason& other) const { return name == std::string_view(other.name); }
  bool operator<(const DropReason& other) const { return name < std::string_view(other.name); }
};

namespace drop {
/// No camera_info with the image's stamp or, if input/camera_info is latest, none at all.
inline constexpr DropReason kNoCameraInfo{"no_camera_info"};
/// No mask with the image's stamp, although masks are used.
inline constexpr DropReason kNoMask{"no_mask"};
/// Encoding that is not supported for this kind of image or for masks, or a cloud without x, y, z.
inline constexpr DropReason kBadEncoding{"bad_encoding"};
/// More pixels than the map accepts, or more bytes than the queue holds.
inline constexpr DropReason kTooLarge{"too_large", true, "lower the camera's resolution"};
/// A cloud with a single row, whose points do not belong to pixels.
inline constexpr DropReason kUnorganised{"unorganised"};
/// No pixels, data that do not fit the size, or data that cannot be decoded.
inline constexpr DropReason kBadImage{"bad_image"};
/// The image differs in size from its camera_info or its mask.
inline constexpr DropReason kSizeMismatch{"size_mismatch"};
/// No pinhole camera: intrinsics or distortion coefficients are invalid, or none fits a cloud.
inline constexpr DropReason kBadIntrinsics{"bad_intrinsics"};
/// Stamp 0, which has no transform.
inline constexpr DropReason kNoStamp{"no_stamp"};
/// Stamp in the last hour of ROS time.
inline constexpr DropReason kBadStamp{"bad_stamp"};
/// Same stamp as the previous image, so one of the two would get a wrong pose.
inline constexpr DropReason kRepeatedStamp{"repeated_stamp"};
/// Name of a frame or an encoding longer than kLongestName.
inline constexpr DropReason kLongName{"long_name"};
/// No transform within the timeout, or no frame_id to look up.
inline constexpr DropReason kNoTransform{
    "no_transform", true, "raise input/tf_timeout_s, or check what publishes the poses"};
/// Older than the known transforms, so its pose can no longer arrive.
inline constexpr DropReason kBeforeTransforms{"before_transforms", false};
/// The oldest waiting frame, dropped to make room or to shorten a backlog.
inline constexpr DropReason kQueueFull{
    "queue_full", true, "use larger voxels (map/voxel_size_m), a GPU, or fewer frames"};
/// With several cameras: older than a depth frame that was already passed to the map.
inline constexpr DropReason kOutOfOrder{"out_of_order", true, "raise input/merge_wait_s"};
/// Waiting in the queue when stamps jumped back.
inline constexpr DropReason kTimeJump{"time_jump", false};
/// The camera would have moved faster than allowed.
inline constexpr DropReason kPoseJump{"pose_jump", true,
                                      "check the pose estimate, or raise input/max_speed_m_s"};
/// Pose not finite, not a rotation, or out of the map's range.
inline constexpr DropReason kBadPose{"bad_pose", true, "check the pose estimate"};
/// No usable depth in range, no surface to paint, or too few points to fit a camera to a cloud.
inline constexpr DropReason kNoMeasurement{"no_measurement"};
/// Too little memory on the GPU for this frame.
inline constexpr DropReason kNoMemory{"no_memory"};
/// Exceeds colour/max_rate_hz.
inline constexpr DropReason kOverRate{"over_rate", false};
/// The map is to be levelled, but the vertical is not known yet.
inline constexpr DropReason kNotLevel{"not_level", false};
/// Does not fit the map, and poses/on_misfit is drop.
inline constexpr DropReason kMisfit{
    "misfit", true, "check the pose estimate, or raise poses/sigma_m and poses/sigma_rad"};
/// Tracking is lost, or has not found the camera again yet.
inline constexpr DropReason kLost{
    "lost", true, "move the camera back to where it was, and then more slowly; or call set_pose"};
inline constexpr DropReason kPaused{"paused", false};
/// The node is shutting down.
inline constexpr DropReason kEnding{"ending", false};
/// The map's backend has failed.
inline constexpr DropReason kBackendError{"backend_error"};
}  // namespace drop

/// Why the mapper did not fuse a frame. @pre `status` is not kFused.
inline DropReason dropReasonOf(FrameStatus status) {
  switch (status) {
    case FrameStatus::kBadIntrinsics: return drop::kBadIntrinsics;
    case FrameStatus::kBadPose: return drop::kBadPose;
    case FrameStatus::kNoMeasurement: return drop::kNoMeasurement;
    case FrameStatus::kNoMemory: return drop::kNoMemory;
    case FrameStatus::kBadImage:
    case FrameStatus::kFused: break;
  }
  return drop::kBadImage;
}

/// Why a frame is dropped.
struct Rejection {
  DropReason reason;
  std::string text;
};

/// The status of the depth or the colour images from one camera, with more details for InputStatus.
struct StreamReport : dtsdf_mapping::StreamStatus {
  StreamReport() { received_age_s = fused_age_s = -1.0f; }

  std::map<DropReason, uint64_t> dropped_by;  ///< Used instead of `dropped`.
  DropReason last_reason{""};                 ///< Reason of `last_drop`.
  uint64_t droppedSum() const {
    return std::accumulate(dropped_by.begin(), dropped_by.end(), uint64_t{0},
                           [](uint64_t sum, const auto& of) { return sum + of.second; });
  }

  std::string camera;      ///< Name; empty for a single camera in the node's namespace.
  bool is_needed = false;  ///< For colour: whether it is required.
  bool isColour() const { return kind == "color"; }
  bool is_cloud = false;  ///< Whether depth is received as clouds.
  std::string info_topic;
  size_t image_publishers = 0;
  std::string warning;  ///< What is wrong with the images, even if they are fused.
};

/// Thread-safe: used by the input, map and status threads.
class FrameAccounting {
 public:
  /// Warnings begin with `name`, unless it is empty.
  explicit FrameAccounting(std::string name = "") : name_(std::move(name)) {}

  void imageReceived(const ros::Time& stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.received;
    counts_.last_stamp = stamp;
    image_at_ = std::chrono::steady_clock::now();
  }

  void cameraInfoReceived() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.camera_infos;
  }

  void fused(const ros::Time& stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.fused;
    counts_.last_fused_stamp = stamp;
    fused_at_ = std::chrono::steady_clock::now();
  }

  void dropped(const Rejection& rejection, const ros::Time& stamp) {
    std::ostringstream message;
    message.imbue(std::locale::classic());
    message << (name_.empty() ? "" : name_ + ": ") << "frame stamped " << stamp << " dropped ("
            << rejection.reason.name << "): " << printableMessage(rejection.text);
    const std::lock_guard<std::mutex> lock(mutex_);
    const uint64_t count = ++counts_.dropped_by[rejection.reason];
    counts_.last_drop = message.str();
    counts_.last_reason = rejection.reason;
    if (mayWarn(rejection.reason)) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                            message.str() << " [" << count << " dropped for this reason so far]");
    }
  }

  /// The counts, including waiting frames, which were received but neither fused nor dropped yet.
  StreamReport counts() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    StreamReport counts = counts_;
    counts.waiting = static_cast<uint32_t>(counts.received - counts.fused - counts.droppedSum());
    counts.received_age_s = ageOf(image_at_);
    counts.fused_age_s = ageOf(fused_at_);
    return counts;
  }

 private:
  bool mayWarn(const DropReason& reason) {
    if (!reason.is_fault) return false;
    constexpr std::chrono::seconds kPeriod{60};
    const SteadyTime now = std::chrono::steady_clock::now();
    const auto [last, is_first] = last_warning_.emplace(reason, now);
    if (!is_first && now - last->second < kPeriod) return false;
    last->second = now;
    return true;
  }

  static float ageOf(const std::optional<SteadyTime>& time) {
    return time ? static_cast<float>(toSeconds(std::chrono::steady_clock::now() - *time)) : -1.0f;
  }

  const std::string name_;
  mutable std::mutex mutex_;
  StreamReport counts_;  ///< Without ages.
  std::optional<SteadyTime> image_at_, fused_at_;
  std::map<DropReason, SteadyTime> last_warning_;
};

}  // namespace dtsdf
