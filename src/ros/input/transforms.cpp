#include "ros/input/transforms.h"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"

namespace dtsdf {
namespace {

/// The stamps of ROS end here, and tf2 throws where it adds what is kept to one of the last.
constexpr double kEndOfTime_s = 4294967296.0;
/// Transforms of a frame that are too old in a row, before its newest one counts as wrong.
constexpr int kTooOldInARow = 10;
/// Frames and publishers that are distinguished; whoever makes up names does not fill the memory.
constexpr size_t kMostNames = 20;
constexpr double kWarningPeriod_s = 5.0;
/// A name is no longer than that: else a few would fill the memory.
constexpr size_t kLongestName = 200;
/// Frames that are asked of at a time: cameras, the map, what services name.
constexpr size_t kMostWanted = 64;
/// Links from a frame to the root.
constexpr int kLongestChain = 100;

const char* const kAhead = "ahead of time";
const char* const kInvalid = "invalid";

bool isFinite(const geometry_msgs::Transform& transform) {
  const auto& t = transform.translation;
  const auto& q = transform.rotation;
  for (const double value : {t.x, t.y, t.z, q.x, q.y, q.z, q.w}) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

/// Why tf2 would not take it, whatever its stamp. tf2 says so itself, but in the log of every one.
std::optional<std::string> whyInvalid(const geometry_msgs::TransformStamped& transform) {
  const std::string child = stripLeadingSlash(transform.child_frame_id);
  const std::string parent = stripLeadingSlash(transform.header.frame_id);
  if (child.empty() || parent.empty()) return "one of its frames has no name";
  if (child.size() > kLongestName || parent.size() > kLongestName) {
    return "the name of one of its frames has more than " + std::to_string(kLongestName) + " bytes";
  }
  if (child == parent) return "it maps a frame to itself";
  if (!isFinite(transform.transform)) return "it has numbers that are not finite";
  const auto& q = transform.transform.rotation;
  const double length = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (std::abs(length - 1.0) > 1e-2) return "its quaternion's length is not 1";
  return std::nullopt;
}

std::string inSeconds(double duration_s) { return formatted("%.3g s", duration_s); }

}  // namespace

TransformBuffer::TransformBuffer(const Options& options, SteadyClock clock,
                                 std::function<ros::Time()> now)
    : options_(options),
      clock_(std::move(clock)),
      now_(std::move(now)),
      core_(ros::Duration(options.kept_s)) {}

ros::Time TransformBuffer::rosTime() {
  return ros::Time::isValid() ? ros::Time::now() : ros::Time();
}

bool TransformBuffer::setTransform(const geometry_msgs::TransformStamped& transform,
                                   const std::string& publisher, bool is_static) noexcept {
  try {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto problem = whyInvalid(transform)) {
      refuse(transform, publisher, kInvalid, *problem);
      return false;
    }
    if (!is_static) {
      if (const auto problem = whyNot(transform)) {
        refuse(transform, publisher, kAhead, *problem);
        return false;
      }
    }
    const std::string child = stripLeadingSlash(transform.child_frame_id);
    if (!keepsNames(child, stripLeadingSlash(transform.header.frame_id))) {
      leaveOut(child, publisher, is_static);
      return false;
    }
    if (!is_static) followTime(transform, publisher);
    // False is said of one that is there already, or too old: both are nothing new.
    if (core_.setTransform(transform, publisher, is_static) && !is_static) taken_at_ = clock_();
    return true;
  } catch (const std::exception& error) {  // of tf2, or no memory
    ROS_WARN_STREAM_THROTTLE_NAMED(kWarningPeriod_s, "dtsdf_mapping",
                                   "a transform was refused: " << errorText(error));
    return false;
  }
}

std::optional<std::string> TransformBuffer::whyNot(
    const geometry_msgs::TransformStamped& transform) const {
  const double stamp_s = transform.header.stamp.toSec();
  if (stamp_s >= kEndOfTime_s - options_.kept_s - 1.0) {
    return "its stamp is at the end of the time that ROS can represent";
  }
  const std::optional<double> present = present_s();
  if (!present || stamp_s - *present <= options_.max_ahead_s) return std::nullopt;
  return "its stamp is " + inSeconds(stamp_s - *present) +
         " ahead of time (input/tf_max_ahead_s); do the clocks agree?";
}

std::optional<double> TransformBuffer::present_s() const {
  const ros::Time now = now_();
  if (image_stamp_.isZero()) {
    return now.isZero() ? std::nullopt : std::optional<double>(now.toSec());
  }
  const double images_s = imagesTime_s();
  const bool one_time = !now.isZero() && std::abs(now.toSec() - images_s) <= options_.kept_s;
  return one_time ? std::max(now.toSec(), images_s) : images_s;
}

void TransformBuffer::followTime(const geometry_msgs::TransformStamped& transform,
                                 const std::string& publisher) {
  const ros::Time stamp = transform.header.stamp;
  Track& track = tracks_[stripLeadingSlash(transform.child_frame_id)];
  const double behind_s = track.newest.toSec() - stamp.toSec();
  if (behind_s <= options_.kept_s) {
    track.newest = std::max(track.newest, stamp);
    track.too_old = 0;
    return;
  }
  if (++track.too_old < kTooOldInARow) return;
  ROS_WARN_STREAM_NAMED("dtsdf_mapping", "the transforms of '"
                                             << printable(transform.child_frame_id) << "' from "
                                             << printable(publisher) << " are "
                                             << inSeconds(behind_s)
                                             << " older than its newest one, so that one was "
                                                "wrong or time went back: all transforms are "
                                                "discarded");
  clearLocked();
  tracks_[stripLeadingSlash(transform.child_frame_id)].newest = stamp;
}

void TransformBuffer::refuse(const geometry_msgs::TransformStamped& transform,
                             const std::string& publisher, const std::string& reason,
                             const std::string& detail) {
  const std::string name = "frame '" + printable(stripLeadingSlash(transform.child_frame_id)) +
                           "' of " + printable(publisher);
  const std::string refused = name + ": " + reason;
  ++report_.refused;
  if (report_.refused_by.count(refused) > 0 || report_.refused_by.size() < kMostNames) {
    ++report_.refused_by[refused];
  }
  report_.last_refusal = name + ": " + detail;
  const SteadyTime now = clock_();
  if (warned_at_ && now - *warned_at_ < toSteadyDuration(kWarningPeriod_s)) return;
  warned_at_ = now;
  ROS_WARN_STREAM_NAMED("dtsdf_mapping", "a transform was refused, " << report_.last_refusal << " ["
                                                                     << report_.refused
                                                                     << " refused so far]");
}

void TransformBuffer::want(const std::string& frame) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto place = std::find(wanted_.begin(), wanted_.end(), frame);
  const bool is_new = place == wanted_.end();
  if (!is_new) wanted_.erase(place);
  wanted_.push_front(frame);
  if (wanted_.size() > kMostWanted) wanted_.pop_back();
  if (is_new && statics_left_out_) statics_wanted_ = true;
}

bool TransformBuffer::takeStaticsWanted() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(statics_wanted_, false);
}

/// Whether it lies between a frame that is asked for and the root, that frame included.
bool TransformBuffer::isWanted(const std::string& frame) const {
  for (const std::string& wanted : wanted_) {
    const std::string* link = &wanted;
    for (int i = 0; i < kLongestChain; ++i) {
      if (*link == frame) return true;
      const auto parent = parents_.find(*link);
      if (parent == parents_.end()) break;
      link = &parent->second;
    }
  }
  return false;
}

/// Wanted frames have as much room again, which names that others make up for their parents share.
bool TransformBuffer::keepsNames(const std::string& child, const std::string& parent) {
  const size_t names = names_.size() + (names_.count(child) == 0) + (names_.count(parent) == 0);
  const bool is_new = names > names_.size();
  const bool beyond = is_new && names > options_.max_frames;
  if (beyond && (names > 2 * options_.max_frames || !isWanted(child))) return false;
  if (is_new) names_.insert({child, parent});
  std::string& known = parents_[child];
  if (!known.empty() && known != parent) former_parents_[child] = known;
  known = parent;
  if (beyond && statics_left_out_) statics_wanted_ = true;  // the next link may be one of them
  return true;
}

void TransformBuffer::leaveOut(const std::string& child, const std::string& publisher,
                               bool is_static) {
  const std::string what = "more than " + std::to_string(options_.max_frames) + " frames";
  const std::string of = printable(publisher) + ": " + what;
  if (is_static) statics_left_out_ = true;
  if (report_.refused_by.count(of) > 0 || report_.refused_by.size() < kMostNames) {
    ++report_.refused_by[of];
  }
  if (++report_.not_kept > 1) return;
  ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                        "there are " << what << " on /tf; only those that the pose "
                                     << "of a camera needs are kept, not '" << printable(child)
                                     << "' of " << printable(publisher));
}

double TransformBuffer::imagesTime_s() const {
  return image_stamp_.toSec() + std::chrono::duration<double>(clock_() - image_at_).count();
}

void TransformBuffer::imageCame(const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (stamp <= image_stamp_ || stamp == ahead_stamp_) return;  // it asks again while it waits
  if (!image_stamp_.isZero() && stamp.toSec() - imagesTime_s() > options_.kept_s) {
    const bool alone = ahead_stamp_.isZero() || stamp < ahead_stamp_ ||
                       stamp.toSec() - ahead_stamp_.toSec() > options_.kept_s;
    ahead_stamp_ = alone ? stamp : ros::Time();
    if (alone) return;
  }
  image_stamp_ = stamp;
  image_at_ = clock_();
}

void TransformBuffer::clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  clearLocked();
  image_stamp_ = ahead_stamp_ = ros::Time();
}

void TransformBuffer::clearLocked() {
  core_.clear();
  tracks_.clear();
}

std::string TransformBuffer::otherParentOf(const std::string& frame,
                                           const std::string& parent) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto* const parents : {&parents_, &former_parents_}) {
    const auto other = parents->find(frame);
    if (other != parents->end() && other->second != parent) return other->second;
  }
  return "";
}

std::vector<std::string> TransformBuffer::frames(size_t most) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> names(names_.begin(), names_.end());
  std::sort(names.begin(), names.end());
  names.resize(std::min(names.size(), most));
  return names;
}

TransformReport TransformBuffer::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  TransformReport report = report_;
  if (taken_at_) report.age_s = std::chrono::duration<double>(clock_() - *taken_at_).count();
  return report;
}

namespace {

/// Messages that may wait; as many as tf2's own listener lets wait.
constexpr uint32_t kQueue = 100;

}  // namespace

TransformInput::TransformInput(const ros::NodeHandle& nh, TransformBuffer& transforms)
    : nh_(nh),
      transforms_(transforms),
      tf_(nh_.subscribe("/tf", kQueue, &TransformInput::onTransforms, this)) {
  subscribeStatic();
  timer_ = nh_.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) {
    guarded("static transforms", [this] {
      if (transforms_.takeStaticsWanted()) subscribeStatic();
    });
  });
}

/// Publishers of static transforms are latched: a new subscriber gets what they sent last. The one
/// before it ends only then, so roscpp keeps the connections: it bears no loss of one of them while
/// a message comes.
void TransformInput::subscribeStatic() {
  tf_static_ = nh_.subscribe("/tf_static", kQueue, &TransformInput::onStaticTransforms, this);
}

void TransformInput::onTransforms(const Event& event) {
  guarded("transforms", [&] { put(event, false); });
}

void TransformInput::onStaticTransforms(const Event& event) {
  guarded("static transforms", [&] { put(event, true); });
}

void TransformInput::put(const Event& event, bool is_static) {
  if (ros::Time::isSimTime()) {
    const ros::Time now = ros::Time::now();
    const ros::Time last = std::exchange(last_now_, now);
    if (now < last) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", "simulated time went back from "
                                                 << last << " to " << now
                                                 << ": transforms are discarded");
      transforms_.clear();
    }
  }
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    transforms_.setTransform(transform, event.getPublisherName(), is_static);
  }
}

}  // namespace dtsdf
