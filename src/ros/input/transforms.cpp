#include "ros/input/transforms.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/input/conversions.h"

namespace dtsdf {
namespace {

/// Longer than any frame waits in a queue that keeps up.
constexpr double kKept_s = 30.0;
/// tf2 keeps each name for ever: of more frames than these, the buffer is made new.
constexpr size_t kMostFrames = 20000;
/// Images without a pose in a row, and for how long, before the buffer is made new.
constexpr int kMostMissing = 5;
constexpr std::chrono::seconds kMissing{2};
/// It is not made new sooner than this after the last time, which doubles each time.
constexpr std::chrono::seconds kFirstRestart{5}, kLastRestart{600};
/// Messages that may wait; as many as tf2's own listener lets wait.
constexpr uint32_t kQueue = 100;

/// The stamp of the newest transform between two frames: the oldest of the newest of its links.
std::optional<ros::Time> findNewest(const tf2::BufferCore& core, const std::string& parent,
                                    const std::string& frame) {
  try {
    return core.lookupTransform(parent, frame, ros::Time(0)).header.stamp;
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

/// Which frame TF lacks, and what to do.
std::string describeFrames(const tf2::BufferCore& core, const std::string& parent,
                           const std::string& frame) {
  std::vector<std::string> frames;
  core._getFrameStrings(frames);
  if (frames.empty()) return "nothing has been received on /tf or /tf_static";
  std::sort(frames.begin(), frames.end());
  const std::string names = listOfFrames(frames);
  for (const std::string& name : {parent, frame}) {
    if (std::binary_search(frames.begin(), frames.end(), name)) continue;
    return "TF has no frame '" + printable(name) + "'; it has " + names +
           "; start what publishes '" + printable(name) + "'" +
           (name == parent ? ", or set map_frame to one of these" : "");
  }
  return "TF has both frames, but no chain of transforms between them; it has " + names;
}

std::string describe(const tf2::BufferCore& core, const std::optional<ros::Time>& newest,
                     const std::string& parent, const std::string& frame, const ros::Time& stamp,
                     const char* what) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "no transform from '" << printable(frame) << "' to '" << printable(parent) << "': ";
  if (!newest) {
    text << describeFrames(core, parent, frame);
  } else if (*newest >= stamp) {
    text << what << " is older than every transform that is kept, of which the newest is "
         << newest->toSec() - stamp.toSec() << " s after it; normal for the first images only";
  } else {
    text << "the newest is stamped " << *newest << ", " << stamp.toSec() - newest->toSec()
         << " s before " << what << " of " << stamp;
  }
  return text.str();
}

}  // namespace

Transforms::Transforms(SteadyClock clock)
    : clock_(std::move(clock)), next_restart_after_(kFirstRestart) {
  core_ = makeCore();
}

void Transforms::subscribe(ros::NodeHandle nh) {
  const auto subscribe = [&](const char* topic, bool is_static) {
    const boost::function<void(const Event&)> callback = [this, is_static](const Event& event) {
      guarded("transforms", [&] { onMessage(event, is_static); });
    };
    return nh.subscribe<tf2_msgs::TFMessage>(topic, kQueue, callback);
  };
  tf_ = subscribe("/tf", false);
  tf_static_ = subscribe("/tf_static", true);
}

void Transforms::onMessage(const Event& event, bool is_static) {
  if (ros::Time::isSimTime()) {
    const ros::Time now = ros::Time::now();
    const ros::Time last = std::exchange(last_now_, now);
    if (now < last) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", "simulated time went back from "
                                                 << last << " to " << now
                                                 << ": transforms are discarded");
      clear();
    }
  }
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    take(transform, event.getPublisherName(), is_static);
  }
}

void Transforms::take(const geometry_msgs::TransformStamped& transform,
                      const std::string& publisher, bool is_static) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::string child = stripLeadingSlash(transform.child_frame_id);
  const std::string& parent = transform.header.frame_id;
  if (child.empty() || child.size() > kLongestName || parent.size() > kLongestName) {
    ++report_.refused;
    ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping",
                                   "a transform of " << printable(publisher)
                                                     << " was refused: the name of a frame is "
                                                        "empty or longer than "
                                                     << kLongestName << " bytes ["
                                                     << report_.refused << " refused so far]");
    return;
  }
  if (statics_.size() + moving_.size() > kMostFrames) {
    moving_.clear();
    statics_.clear();
    restart(formatted("TF has more than %zu frames", kMostFrames));
  }
  if (is_static) {
    if (ignored_statics_.count(child) > 0) return;
    statics_[child] = transform;
  } else {
    moving_.insert(child);
    received_at_ = clock_();
  }
  try {
    if (!core_->setTransform(transform, publisher, is_static)) ++report_.refused;  // tf2 says why
  } catch (const std::exception& error) {  // for a stamp at the end of time, or no memory
    ++report_.refused;
    ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping",
                                   "a transform was refused: " << errorText(error));
  }
}

Transforms::Core Transforms::makeCore() const {
  auto core = std::make_shared<tf2::BufferCore>(ros::Duration(kKept_s));
  for (const auto& [child, transform] : statics_) {
    if (ignored_statics_.count(child) == 0) core->setTransform(transform, "static", true);
  }
  return core;
}

void Transforms::restart(const std::string& why) {
  ++report_.restarts;
  report_.last_restart = why;
  ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                        why << ": all transforms are discarded, and received again");
  for (const std::string& child : moving_) {
    if (statics_.erase(child) > 0) ignored_statics_.insert(child);
  }
  moving_.clear();
  core_ = makeCore();
}

void Transforms::notePose(bool is_found) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (is_found) {
    missing_ = 0;
    missing_since_.reset();
    return;
  }
  const SteadyTime now = clock_();
  if (!missing_since_) missing_since_ = now;
  const bool is_lasting = ++missing_ >= kMostMissing && now - *missing_since_ >= kMissing;
  const bool tf_comes = received_at_ && *received_at_ > *missing_since_;
  if (!is_lasting || !tf_comes) return;
  if (restarted_at_) {
    if (now - *restarted_at_ < next_restart_after_) return;
    next_restart_after_ = std::min<SteadyDuration>(2 * next_restart_after_, kLastRestart);
  }
  restarted_at_ = now;
  restart("images find no pose although transforms are received");
}

void Transforms::clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  core_ = makeCore();
}

Transforms::Core Transforms::core() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return core_;
}

PoseAnswer Transforms::find(const std::string& parent, const std::string& frame,
                            const ros::Time& stamp, const char* what) const {
  PoseAnswer answer;
  if (frame.size() > kLongestName || parent.size() > kLongestName) {
    answer.text = formatted("the name of a frame is longer than %zu bytes", kLongestName);
    return answer;
  }
  const Core core = this->core();
  // Before the look-up itself: a transform that arrives in between may not count as one that has
  // passed the image.
  const std::optional<ros::Time> newest = findNewest(*core, parent, frame);
  try {
    answer.T_W_C = toIsometry(core->lookupTransform(parent, frame, stamp).transform);
    return answer;
  } catch (const std::runtime_error&) {
    // tf2's own exceptions, and that of ros::Duration where stamps lie over 68 years apart.
  }
  answer.may_come = !newest || *newest < stamp;
  answer.text = describe(*core, newest, parent, frame, stamp, what);
  if (core->allFramesAsString().empty() && report().refused > 0) {
    answer.text = "all transforms received were refused: NaN, no rotation, or no name of a frame";
  }
  return answer;
}

std::string Transforms::otherParentOf(const std::string& frame, const std::string& parent) const {
  std::string other;
  const bool has_parent = core()->_getParent(frame, ros::Time(0), other);
  return has_parent && other != parent ? other : "";
}

TransformReport Transforms::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  TransformReport report = report_;
  if (received_at_) report.age_s = toSeconds(clock_() - *received_at_);
  return report;
}

}  // namespace dtsdf
