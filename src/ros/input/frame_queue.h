/// The queue between topics and the map. It joins messages into frames, keeps each frame until its
/// pose is known and its turn has come, and drops frames if it is full.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <ros/serialization.h>
#include <ros/time.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "ros/common/pace.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/images.h"

namespace dtsdf {

/// If stamps go back by more than this, a recording has started or restarted. If they go back by
/// less, messages are out of order.
constexpr double kTimeJump_s = 0.5;

/// A frame and the owner of its pixels.
struct PosedFrame {
  ros::Time stamp;
  std::variant<DepthFrame, ColourFrame> image;
  cv_bridge::CvImageConstPtr pixels;
  /// Pose in the map, before alignment and correction.
  Eigen::Isometry3d given_T_W_C = Eigen::Isometry3d::Identity();
  std::string frame_id;                   ///< Frame of its camera.
  size_t camera = 0;                      ///< Index of the camera.
  FrameAccounting* accounting = nullptr;  ///< Counts for its stream.

  const Eigen::Isometry3d& T_W_C() const {
    return std::visit([](const auto& of) -> const Eigen::Isometry3d& { return of.T_W_C; }, image);
  }

  void move(const Eigen::Isometry3d& T) {
    std::visit([&](auto& of) { of.T_W_C = T * of.T_W_C; }, image);
  }
};

/// A stream consists of the depth or the colour images of one camera. Frames of all streams are
/// ordered by stamp, then depth before colour, then by stream. A frame is incomplete until all
/// messages with its stamp have arrived, then whole until its pose is known, then posed until its
/// turn. Its turn comes when no other stream can deliver an earlier frame, or after `merge_wait_s`.
///
/// A limit in bytes applies to all streams together. Beyond it, the oldest frame of a random stream
/// is dropped; streams with many frames are chosen more often. Every image is either dropped with a
/// reason or returned by take(). Thread-safe once all streams have been added.
class FrameQueue {
 public:
  using Stream = size_t;

  /// @param max_images Maximum number of waiting images per stream.
  /// @param max_bytes Maximum number of waiting bytes in all streams together.
  /// @param merge_wait_s How long a frame waits for earlier frames from other streams.
  /// @param on_ready Called by poseFirst() when there may be a frame to take.
  FrameQueue(size_t max_images, size_t max_bytes, double merge_wait_s,
             std::function<void()> on_ready, SteadyClock clock = waitingTime)
      : max_images_(max_images),
        max_bytes_(max_bytes),
        merge_wait_(toSteadyDuration(merge_wait_s)),
        on_ready_(std::move(on_ready)),
        clock_(std::move(clock)) {}

  /// @param is_colour Frames of other streams wait for a colour stream only after its first posed
  /// frame, since colour may never arrive. Late colour frames are accepted.
  /// @param no_info Text for an image that has no camera_info.
  /// @param no_mask Text for an image that has no mask; none if masks are not used.
  /// @param accounting Must outlive the queue.
  Stream addStream(bool is_colour, std::string no_info, std::optional<std::string> no_mask,
                   FrameAccounting& accounting) {
    const std::lock_guard<std::mutex> lock(mutex_);
    streams_.push_back({is_colour, std::move(no_info), std::move(no_mask), &accounting});
    return streams_.size() - 1;
  }

  /// On the input thread: adds one message, or an image with a camera_info of any stamp. Messages
  /// with the same stamp form a frame, whatever their order. Once a frame is whole, incomplete
  /// frames of its stream that arrived before it and have earlier stamps are dropped.
  void add(Stream stream, const CameraImage& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    StreamState& state = streams_[stream];
    const auto& [image, info, mask] = message;
    const ros::Time stamp = (image ? image->header : info ? info->header : mask->header).stamp;
    if (refusal_) {
      if (image) state.accounting->dropped(*refusal_, stamp);
      return;
    }
    auto place = findFirst([&](const Entry& entry) {
      return entry.stream == stream && entry.stamp == stamp && isIncomplete(entry);
    });
    if (place != entries_.end() && image && place->messages.image) {  // a repeated stamp
      dropIncomplete(place);
      place = entries_.end();
    }
    if (place == entries_.end()) place = addEntry(stream, stamp);
    CameraImage& messages = place->messages;
    if (image) messages.image = image;
    if (info) messages.info = info;
    if (mask) messages.mask = mask;
    if (completeIfWhole(place)) shorten(stream);
    makeRoom(stream);
  }

  /// On the input thread: adds a camera_info of any stamp to all images that lack one.
  void addToWaiting(Stream stream, const sensor_msgs::CameraInfoConstPtr& info) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (auto it = entries_.begin(); it != entries_.end(); ++it) {
      if (it->stream != stream || !it->messages.image || it->messages.info) continue;
      it->messages.info = info;
      completeIfWhole(it);
    }
    makeRoom(stream);
  }

  /// What happens to a frame: it waits (the text says for what), is dropped, or gets its pose.
  using Decision = std::variant<std::string, Rejection, PosedFrame>;
  /// Decides on a whole frame. `since` is when it became whole.
  using Decide = std::function<Decision(const CameraImage& messages, SteadyTime since)>;
  /// Calls `decide`, without holding the mutex, for the first whole frame of a stream.
  /// @return false if there is none, or it has to wait.
  bool poseFirst(Stream stream, const Decide& decide) {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto first =
        findFirst([&](const Entry& entry) { return entry.stream == stream && isWhole(entry); });
    if (first == entries_.end()) return false;
    const uint64_t number = first->number;
    const CameraImage messages = first->messages;
    const SteadyTime since = first->since;
    lock.unlock();
    Decision decision = decide(messages, since);
    lock.lock();
    const auto place = findFirst([&](const Entry& entry) { return entry.number == number; });
    if (place == entries_.end()) return true;  // dropped in the meantime
    if (const auto* const text = std::get_if<std::string>(&decision)) {
      streams_[stream].waiting_for = *text;
      return false;
    }
    apply(place, std::move(decision));
    lock.unlock();
    on_ready_();  // the turn of this or another frame may have come
    return true;
  }

  /// Starts a stream over after its stamps have jumped back to `stamp`: drops its frames with later
  /// stamps.
  void restart(Stream stream, const ros::Time& stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    StreamState& state = streams_[stream];
    state.waiting_for.clear();
    state.complete_until = ros::Time();
    if (!state.is_colour) last_taken_ = ros::Time();
    dropAll({drop::kTimeJump, "stamps went back while it waited"},
            [&](const Entry& entry) { return entry.stream == stream && entry.stamp > stamp; });
  }

  /// On the map thread: takes the first posed frame, if its turn has come.
  std::optional<PosedFrame> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (timeToTurn() > SteadyDuration::zero()) return std::nullopt;
    const auto first = findFirst(isPosed);
    StreamState& stream = streams_[first->stream];
    if (!stream.is_colour) last_taken_ = std::max(last_taken_, first->stamp);
    PosedFrame frame = std::move(first->posed);
    entries_.erase(first);
    return frame;
  }

  bool hasTurn() const { return idleTime() == SteadyDuration::zero(); }
  /// Time until the next frame's turn if no message arrives; the maximum duration if no frame has a
  /// pose.
  SteadyDuration idleTime() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return timeToTurn();
  }

  /// On any thread: drops all waiting and future frames for this reason. Without a reason, accepts
  /// frames again, unless the node is shutting down.
  void refuseAll(std::optional<Rejection> refusal) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (refusal_ && refusal_->reason == drop::kEnding) return;
    refusal_ = std::move(refusal);
    if (!refusal_) return;
    for (StreamState& stream : streams_) stream.waiting_for.clear();
    dropAll(*refusal_, [](const auto&) { return true; });
  }

  /// May be called on any thread.
  bool isPaused() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return refusal_ && refusal_->reason == drop::kPaused;
  }

  size_t bytes() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return bytesOfAll();
  }

  size_t maxBytes() const { return max_bytes_; }
  /// What the stream's first frame is waiting for; empty if there is none, or if it only waits for
  /// its turn.
  std::string waitingFor(Stream stream) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const StreamState& state = streams_[stream];
    if (!state.waiting_for.empty()) return state.waiting_for;
    const auto first = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
      return entry.stream == stream && entry.hasImage() && isIncomplete(entry);
    });
    return first == entries_.end() ? "" : missingOf(*first)->text;
  }

 private:
  /// Maximum number of messages per stream that wait for their image. Images are sent over a
  /// separate connection and may be late.
  static constexpr size_t kMaxWithoutImage = 50;
  /// A backlog of up to this many frames is never shortened, so that the map does not run out of
  /// frames.
  static constexpr size_t kBusyFrames = 3;

  struct Entry {
    Stream stream;
    ros::Time stamp;
    uint64_t number;            ///< Order of arrival.
    CameraImage messages = {};  ///< Empty once the frame has its pose.
    SteadyTime since = {};      ///< When it arrived, became whole or got its pose.
    PosedFrame posed = {};      ///< Has an `accounting` once the frame has its pose.

    bool hasImage() const { return isPosed(*this) || messages.image != nullptr; }
  };
  using Entries = std::list<Entry>;  // in the order of their turns
  struct StreamState {
    bool is_colour;
    std::string no_info;
    std::optional<std::string> no_mask;
    FrameAccounting* accounting;
    ros::Time complete_until = {};  ///< Frames up to this stamp are no longer expected.
    bool has_posed_frame = false;
    std::string waiting_for = {};
    bool is_overloaded = false;  ///< Whether to shorten the backlog until it is gone.

    bool mustWaitFor() const { return !is_colour || has_posed_frame; }
  };

  // Call the functions below with mutex_ held.
  /// Inserts an entry in order: by stamp, depth before colour, by stream, by arrival.
  Entries::iterator addEntry(Stream stream, const ros::Time& stamp) {
    const auto orderKey = [this](const Entry& entry) {
      return std::tie(entry.stamp, streams_[entry.stream].is_colour, entry.stream);
    };
    const Entry added{stream, stamp, ++arrivals_, {}, clock_()};
    return entries_.insert(
        findFirst([&](const Entry& entry) { return orderKey(added) < orderKey(entry); }), added);
  }

  static size_t bytesOf(const Entry& entry) {
    if (isPosed(entry)) {
      return std::visit(
          [](const auto& image) { return image.row_bytes * static_cast<size_t>(image.height); },
          entry.posed.image);
    }
    const auto& [image, info, mask] = entry.messages;
    const auto lengthOf = [](const auto& of) {
      return of ? ros::serialization::serializationLength(*of) : 0u;
    };
    return size_t{lengthOf(image)} + lengthOf(info) + lengthOf(mask);
  }

  size_t bytesOfAll() const {
    return std::accumulate(entries_.begin(), entries_.end(), size_t{0},
                           [](size_t sum, const Entry& entry) { return sum + bytesOf(entry); });
  }

  /// The message that a frame still lacks; nothing if it is whole.
  std::optional<Rejection> missingOf(const Entry& entry) const {
    const StreamState& stream = streams_[entry.stream];
    if (!entry.messages.info) return Rejection{drop::kNoCameraInfo, stream.no_info};
    if (!stream.no_mask || entry.messages.mask) return std::nullopt;
    return Rejection{drop::kNoMask, *stream.no_mask};
  }

  static bool isPosed(const Entry& entry) { return entry.posed.accounting != nullptr; }
  bool isWhole(const Entry& entry) const { return entry.messages.image && !missingOf(entry); }
  bool isIncomplete(const Entry& entry) const { return !isPosed(entry) && !isWhole(entry); }

  /// @pre The entry was incomplete. @return whether it has just become whole.
  bool completeIfWhole(Entries::iterator place) {
    Entry& entry = *place;
    if (!isWhole(entry)) return false;
    entry.since = clock_();
    for (auto it = entries_.begin(); it != place;) {
      const auto before = it++;
      // Frames that arrived after this one may still become whole.
      const bool came_before = before->number < entry.number;
      if (before->stream == entry.stream && came_before && isIncomplete(*before)) {
        dropIncomplete(before);
      }
    }
    return true;
  }

  /// Drops a frame, or gives it its pose.
  void apply(Entries::iterator place, Decision decision) {
    Entry& entry = *place;
    StreamState& stream = streams_[entry.stream];
    stream.waiting_for.clear();
    const auto* const rejection = std::get_if<Rejection>(&decision);
    stream.complete_until = std::max(stream.complete_until, entry.stamp);
    if (rejection != nullptr) return drop(place, *rejection);
    if (isTooLate(entry)) {
      return drop(place, {drop::kOutOfOrder,
                          "a later frame has already been fused; if it is from another camera, "
                          "raise input/merge_wait_s above this camera's delay"});
    }
    entry.posed = std::move(std::get<PosedFrame>(decision));
    entry.posed.accounting = stream.accounting;
    entry.messages = {};  // `posed` owns the pixels now
    entry.since = clock_();
    stream.has_posed_frame = true;
  }

  template <class Wanted>
  Entries::iterator findFirst(const Wanted& wanted) {
    return std::find_if(entries_.begin(), entries_.end(), wanted);
  }

  /// The wanted entry that arrived first. If the order were by stamp, frames from a camera whose
  /// clock is ahead would never be dropped.
  template <class Wanted>
  Entries::iterator findOldest(const Wanted& wanted) {
    auto first = entries_.end();
    for (auto it = entries_.begin(); it != entries_.end(); ++it) {
      if (!wanted(*it)) continue;
      if (first == entries_.end() || it->number < first->number) first = it;
    }
    return first;
  }

  void drop(Entries::iterator place, const Rejection& rejection) {
    // Messages without an image are not counted as a frame.
    if (place->hasImage()) streams_[place->stream].accounting->dropped(rejection, place->stamp);
    entries_.erase(place);
  }

  void dropIncomplete(Entries::iterator place) {
    drop(place, missingOf(*place).value_or(Rejection{drop::kNoCameraInfo, ""}));
  }

  template <class Wanted>
  void dropAll(const Rejection& rejection, const Wanted& wanted) {
    for (auto it = entries_.begin(); it != entries_.end();) {
      const auto place = it++;
      if (wanted(*place)) drop(place, rejection);
    }
  }

  template <class Wanted>
  size_t countOf(const Wanted& wanted) const {
    return static_cast<size_t>(std::count_if(entries_.begin(), entries_.end(), wanted));
  }

  static auto isImageOf(Stream stream) {
    return [stream](const Entry& entry) { return entry.stream == stream && entry.hasImage(); };
  }

  size_t imagesOf(Stream stream) const { return countOf(isImageOf(stream)); }

  void makeRoom(Stream stream) {
    const auto isOther = [&](const Entry& entry) {
      return entry.stream == stream && !entry.hasImage();
    };
    if (countOf(isOther) > kMaxWithoutImage) entries_.erase(findOldest(isOther));
    while (imagesOf(stream) > max_images_) {
      // If the map is too slow, all streams share the loss. If messages or poses are late, only
      // their own stream loses frames.
      const bool is_slow = isPosed(*findOldest(isImageOf(stream)));
      if (is_slow) streams_[stream].is_overloaded = true;
      is_slow ? dropOneOf(isPosed) : dropOldest(stream);
    }
    while (bytesOfAll() > max_bytes_) {
      dropOneOf([](const Entry& entry) { return entry.hasImage(); });
    }
  }

  /// Once the queue has been full, shortens the backlog by dropping a frame for each new one, until
  /// the map has caught up.
  void shorten(Stream stream) {
    const size_t waiting = countOf([&](const Entry& entry) {
      return entry.stream == stream && isPosed(entry) && !canComeBefore(entry.stamp);
    });
    bool& is_overloaded = streams_[stream].is_overloaded;
    is_overloaded = is_overloaded && waiting > 0;
    if (is_overloaded && waiting > kBusyFrames) dropOneOf(isPosed);
  }

  /// Drops the oldest frame of the stream of a random wanted entry, or the oldest entry if none is
  /// wanted. The choice is random, because under a fixed rule, one stream could lose all its
  /// frames.
  template <class Wanted>
  void dropOneOf(const Wanted& wanted) {
    const size_t count = countOf(wanted);
    if (count == 0)
      return drop(findOldest([](const Entry&) { return true; }), {drop::kQueueFull, ""});
    size_t before = random_() % count;
    dropOldest(findFirst([&](const Entry& e) { return wanted(e) && before-- == 0; })->stream);
  }

  /// @pre The stream has an image.
  void dropOldest(Stream stream) {
    const auto place = findOldest(isImageOf(stream));
    if (isIncomplete(*place)) return dropIncomplete(place);
    const std::string& waiting_for = streams_[stream].waiting_for;
    const bool waits_for_pose = !isPosed(*place) && !waiting_for.empty();
    drop(place, {drop::kQueueFull,
                 "the queue is full: " +
                     (waits_for_pose
                          ? "the oldest image still waits for its transform (" + waiting_for + ")"
                          : "fusing takes longer than the time between images")});
  }

  /// Whether a stream may still deliver an earlier frame.
  bool canComeBefore(const ros::Time& stamp) const {
    return std::any_of(streams_.begin(), streams_.end(), [&](const StreamState& stream) {
      return stream.mustWaitFor() && stream.complete_until < stamp;
    });
  }

  /// Whether, with several cameras, a depth frame with a later stamp has already been taken.
  bool isTooLate(const Entry& entry) const {
    const auto cameras = std::count_if(streams_.begin(), streams_.end(),
                                       [](const auto& state) { return !state.is_colour; });
    return cameras > 1 && !streams_[entry.stream].is_colour && entry.stamp < last_taken_;
  }

  /// Time until the turn of the first posed frame.
  SteadyDuration timeToTurn() const {
    const auto first = std::find_if(entries_.begin(), entries_.end(), isPosed);
    if (first == entries_.end()) return SteadyDuration::max();
    if (!canComeBefore(first->stamp)) return SteadyDuration::zero();
    // Once any posed frame has waited long enough, the first posed frame has its turn.
    SteadyTime since = SteadyTime::max();
    for (const Entry& entry : entries_) {
      if (isPosed(entry)) since = std::min(since, entry.since);
    }
    const SteadyTime end = since + merge_wait_;
    return std::max(SteadyDuration::zero(), end - clock_());
  }

  const size_t max_images_, max_bytes_;
  const SteadyDuration merge_wait_;
  const std::function<void()> on_ready_;
  const SteadyClock clock_;

  mutable std::mutex mutex_;  ///< Guards the members below.
  std::vector<StreamState> streams_;
  Entries entries_;
  uint64_t arrivals_ = 0;
  std::minstd_rand random_;
  ros::Time last_taken_;
  std::optional<Rejection> refusal_;  ///< Why frames are refused; none if they are accepted.
};

}  // namespace dtsdf
