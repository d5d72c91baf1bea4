/// What became of every frame, stream by stream: fused, or dropped for a reason, which is warned
/// about.
#pragma once

#include <dtsdf_mapping/StreamStatus.h>
#include <ros/console.h>
#include <ros/time.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "dtsdf_mapping/mapper.h"
#include "params/printable.h"
#include "ros/common/pace.h"

namespace dtsdf {

enum class DropReason {
  kNoCameraInfo,      ///< No camera_info with the image's stamp.
  kNoMask,            ///< No mask with the image's stamp, where there are masks.
  kBadEncoding,       ///< None that images of this kind have.
  kTooLarge,          ///< More pixels than a map takes, or more bytes than may wait.
  kUnorganised,       ///< A cloud whose points belong to no pixels.
  kBadImage,          ///< No pixels, or rows and data that do not fit its size.
  kSizeMismatch,      ///< Image and camera_info differ in size.
  kBadIntrinsics,     ///< Focal length not positive, or not finite.
  kNoStamp,           ///< Stamp 0: no transform belongs to it.
  kBadStamp,          ///< At the end of the time that ROS can represent.
  kRepeatedStamp,     ///< That of the image before, which one transform cannot both belong to.
  kLongName,          ///< The name of its frame or its encoding is longer than any real one.
  kNoTransform,       ///< None within the timeout.
  kBeforeTransforms,  ///< Older than the transforms known: none can come.
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
  kEnding,        ///< The node ends.
  kBackendError,  ///< The map's backend has failed.
};
constexpr int kDropReasonCount = static_cast<int>(DropReason::kBackendError) + 1;

/// In the spelling of the status message: "no_transform".
const char* toString(DropReason reason);

/// What to do against drops for a reason; empty where the text of the last drop has to do.
const char* remedyFor(DropReason reason);

/// Whether frames that are dropped for it are amiss: not as mapping is paused.
bool isFault(DropReason reason);

/// The reason for a frame that the mapper did not fuse; `status` is not kFused.
DropReason dropReasonOf(FrameStatus status);

/// What a check has to say against a frame.
struct Rejection {
  DropReason reason;
  std::string text;
};

/// One kind of images of one camera: what the status says of them, and what else is judged.
struct StreamReport : dtsdf_mapping::StreamStatus {
  StreamReport() { received_age_s = camera_info_age_s = fused_age_s = -1.0f; }

  std::array<uint64_t, kDropReasonCount> dropped_by{};  ///< By reason, in place of `dropped`.
  uint64_t droppedSum() const;

  std::string camera;      ///< Its name; empty for the only one, in the node's own namespace.
  bool is_needed = false;  ///< Colour: it is amiss if there is none.
  bool isColour() const { return kind == "color"; }
  bool is_cloud = false;  ///< It comes as clouds.
  std::string info_topic;
  size_t image_publishers = 0;
  std::string warning;  ///< What is wrong with all of them, fused or not.
};

/// Counts what became of every frame and warns, throttled, about those that were dropped. Of the
/// images of one stream. Thread safe: callbacks, intake and map all count here.
class FrameAccounting {
 public:
  /// `name` begins the warnings, where there are several streams.
  explicit FrameAccounting(std::string name = "",
                           SteadyClock clock = std::chrono::steady_clock::now)
      : name_(std::move(name)), clock_(std::move(clock)) {}

  void imageReceived(const ros::Time& stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.received;
    counts_.last_stamp = stamp;
    image_at_ = clock_();
  }

  void cameraInfoReceived() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.camera_infos;
    camera_info_at_ = clock_();
  }

  void fused(const ros::Time& stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.fused;
    counts_.last_fused_stamp = stamp;
    fused_at_ = clock_();
  }

  void dropped(const Rejection& rejection, const ros::Time& stamp) {
    std::ostringstream message;
    message.imbue(std::locale::classic());
    message << (name_.empty() ? "" : name_ + ": ") << "frame stamped " << stamp << " dropped ("
            << toString(rejection.reason) << "): " << printableMessage(rejection.text);
    const std::lock_guard<std::mutex> lock(mutex_);
    const uint64_t count = ++counts_.dropped_by[static_cast<size_t>(rejection.reason)];
    counts_.last_drop = message.str();
    if (mayWarn(rejection.reason)) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                            message.str() << " [" << count << " dropped for this reason so far]");
    }
  }

  /// The counts, and what of them is received and waits: it is neither fused nor dropped yet.
  StreamReport counts() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    StreamReport counts = counts_;
    counts.waiting = static_cast<uint32_t>(counts.received - counts.fused - counts.droppedSum());
    counts.received_age_s = ageOf(image_at_);
    counts.camera_info_age_s = ageOf(camera_info_at_);
    counts.fused_age_s = ageOf(fused_at_);
    return counts;
  }

 private:
  bool mayWarn(DropReason reason) {
    const bool is_asked_for = reason == DropReason::kPaused || reason == DropReason::kOverRate ||
                              reason == DropReason::kEnding;
    if (is_asked_for) return false;
    constexpr double kPeriod_s = 60.0;
    ros::WallTime& last = last_warning_[static_cast<size_t>(reason)];
    const ros::WallTime now = ros::WallTime::now();
    if (!last.isZero() && (now - last).toSec() < kPeriod_s) return false;
    last = now;
    return true;
  }

  float ageOf(const std::optional<SteadyTime>& time) const {
    return time ? static_cast<float>(toSeconds(clock_() - *time)) : -1.0f;
  }

  const std::string name_;
  const SteadyClock clock_;
  mutable std::mutex mutex_;
  StreamReport counts_;  ///< Without ages.
  std::optional<SteadyTime> image_at_, camera_info_at_, fused_at_;
  std::array<ros::WallTime, kDropReasonCount> last_warning_{};
};

}  // namespace dtsdf
