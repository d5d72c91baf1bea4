/// The queue to the map's thread: images with their poses, of all streams, in the order to fuse and
/// to paint.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <ros/time.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "ros/common/schedule.h"

namespace dtsdf {

/// Which of two items with one stamp goes first: the one of lower rank, or else of lesser name.
struct StreamOrder {
  int rank = 0;
  std::string name;

  bool operator<(const StreamOrder& other) const {
    return std::tie(rank, name) < std::tie(other.rank, other.name);
  }
};

/// Whether a stream is one that all is in order with.
enum class StreamUse {
  kNeeded,
  /// May never bring anything: it is waited for from its first item on. What it brings late goes at
  /// once, and nobody is refused for what it has brought.
  kExtra,
};

/// Items wait until no other stream can bring an earlier one any more, but no longer than a given
/// time; what comes later than that is refused. Streams bring their items in the order of stamps;
/// with a single one there is nothing to merge, and its items stay in the order they came in.
/// Thread safe. Streams are added before anything is pushed.
template <class Item>
class MergeQueue {
 public:
  using Stream = size_t;

  /// `on_change` is called when there may be something to take, by the thread that brought it.
  MergeQueue(double wait_s, std::function<void()> on_change,
             SteadyClock clock = std::chrono::steady_clock::now)
      : wait_(toSteadyDuration(wait_s)),
        on_change_(std::move(on_change)),
        clock_(std::move(clock)) {}

  Stream addStream(StreamOrder order, StreamUse use = StreamUse::kNeeded) {
    const std::lock_guard<std::mutex> lock(mutex_);
    streams_.push_back({std::move(order), use == StreamUse::kNeeded, ros::Time(), 0});
    return streams_.size() - 1;
  }

  /// False if something later was taken already: the item is out of order, and left alone.
  [[nodiscard]] bool push(Stream stream, const ros::Time& stamp, Item&& item) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      heard(stream, stamp);
      if (isRefused(streams_[stream], stamp)) return false;
      streams_[stream].has_come = true;
      const Key key{merges() ? stamp : ros::Time(), streams_[stream].order, ++pushes_};
      items_.emplace(key, Entry{std::move(item), stream, clock_()});
      ++streams_[stream].size;
    }
    on_change_();
    return true;
  }

  /// The stream brings nothing of this stamp or before any more.
  void settle(Stream stream, const ros::Time& stamp) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      heard(stream, stamp);
    }
    on_change_();
  }

  /// The first item, if it is its turn. Does not wait.
  std::optional<Item> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (timeToTurn() > SteadyDuration::zero()) return std::nullopt;
    const auto& [key, entry] = *items_.begin();
    StreamState& stream = streams_[entry.stream];
    if (stream.needed) last_taken_ = std::max(last_taken_, key.stamp);
    ++stream.taken;
    return remove(items_.begin());
  }

  /// The first item of a stream, whether it is its turn or not.
  std::optional<Item> takeOf(Stream stream) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto first = firstOf(items_.begin(), stream);
    if (first == items_.end()) return std::nullopt;
    return remove(first);
  }

  /// Removes the first item of a stream, where there is no room for all. If that item is the next
  /// to be taken and other streams wait too, it stays and the stream's second item goes: else a
  /// stream that always comes second would lose each item just before its turn.
  std::optional<Item> pushOut(Stream stream) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto first = firstOf(items_.begin(), stream);
    if (first == items_.end()) return std::nullopt;
    if (first != firstNeeded() || !isNeededElsewhere(stream)) return remove(first);
    const auto second = firstOf(std::next(first), stream);
    return remove(second != items_.end() ? second : first);
  }

  /// Whether a stream has an item that is earlier than the stamp. Not where nothing is merged.
  bool holdsBefore(Stream stream, const ros::Time& stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto first = firstOf(items_.begin(), stream);
    return first != items_.end() && merges() && first->first.stamp < stamp;
  }

  /// The first item of an extra stream that is earlier than the stamp. Its own queue may reach
  /// farther back than those of the others, which would never have their turn then.
  std::optional<Item> takeExtraBefore(const ros::Time& stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (auto it = items_.begin(); it != items_.end() && it->first.stamp < stamp; ++it) {
      if (!streams_[it->second.stream].needed) return remove(it);
    }
    return std::nullopt;
  }

  bool isNeeded(Stream stream) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return streams_[stream].needed;
  }

  std::deque<Item> takeAllOf(Stream stream) {
    std::deque<Item> all;
    while (std::optional<Item> item = takeOf(stream)) all.push_back(std::move(*item));
    return all;
  }

  /// Stamps begin anew: any may come now.
  void forgetStamps() {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_taken_ = ros::Time();
    for (StreamState& stream : streams_) stream.heard = ros::Time();
  }

  bool hasTurn() const { return idleTime() == SteadyDuration::zero(); }

  /// How long until something can be taken, if nothing comes meanwhile.
  SteadyDuration idleTime() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return timeToTurn();
  }

  size_t size() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return items_.size();
  }

  size_t sizeOf(Stream stream) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return streams_[stream].size;
  }

  /// How many of a stream's items had their turn.
  size_t takenOf(Stream stream) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return streams_[stream].taken;
  }

  /// How many of a stream's items wait for nothing but to be taken.
  size_t backlogOf(Stream stream) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!merges()) return streams_[stream].size;
    const auto waits = [&](const auto& entry) {
      return entry.second.stream == stream && !canComeBefore(entry.first.stamp);
    };
    return static_cast<size_t>(std::count_if(items_.begin(), items_.end(), waits));
  }

  /// What `measure` says of a stream's items, added up.
  template <class Measure>
  size_t sumOf(Stream stream, Measure measure) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    size_t sum = 0;
    for (const auto& [key, entry] : items_) {
      if (entry.stream == stream) sum += measure(entry.item);
    }
    return sum;
  }

 private:
  struct Key {
    ros::Time stamp;
    StreamOrder order;
    uint64_t push;  ///< In the order of arrival, where all else is equal.

    bool operator<(const Key& other) const {
      return std::tie(stamp, order, push) < std::tie(other.stamp, other.order, other.push);
    }
  };
  struct Entry {
    Item item;
    Stream stream;
    SteadyTime arrival;
  };
  struct StreamState {
    StreamOrder order;
    bool needed;
    ros::Time heard;  ///< Nothing of this stamp or before comes any more.
    size_t size;
    bool has_come = false;  ///< An item of it.
    size_t taken = 0;       ///< By take().

    bool isWaitedFor() const { return needed || has_come; }
  };
  using Items = std::map<Key, Entry>;

  /// Once it merges, it goes on to, as a key of a stamp and one without have no order.
  bool merges() const {
    return std::count_if(streams_.begin(), streams_.end(),
                         [](const StreamState& stream) { return stream.isWaitedFor(); }) > 1;
  }

  bool isRefused(const StreamState& stream, const ros::Time& stamp) const {
    const auto needed = std::count_if(streams_.begin(), streams_.end(),
                                      [](const StreamState& other) { return other.needed; });
    return stream.needed && needed > 1 && stamp < last_taken_;
  }

  void heard(Stream stream, const ros::Time& stamp) {
    streams_[stream].heard = std::max(streams_[stream].heard, stamp);
  }

  /// Whether some stream may still bring something earlier.
  bool canComeBefore(const ros::Time& stamp) const {
    return std::any_of(streams_.begin(), streams_.end(), [&](const StreamState& stream) {
      return stream.isWaitedFor() && stream.heard < stamp;
    });
  }

  /// Zero, if it is the first item's turn.
  SteadyDuration timeToTurn() const {
    if (items_.empty()) return SteadyDuration::max();
    if (!canComeBefore(items_.begin()->first.stamp)) return SteadyDuration::zero();
    // One that has waited long enough goes, and what is before it goes first.
    SteadyTime arrival = SteadyTime::max();
    for (const auto& [key, entry] : items_) arrival = std::min(arrival, entry.arrival);
    return std::max(SteadyDuration::zero(), arrival + wait_ - clock_());
  }

  typename Items::iterator firstOf(typename Items::iterator from, Stream stream) {
    return std::find_if(from, items_.end(),
                        [&](const auto& entry) { return entry.second.stream == stream; });
  }

  typename Items::iterator firstNeeded() {
    return std::find_if(items_.begin(), items_.end(),
                        [&](const auto& entry) { return streams_[entry.second.stream].needed; });
  }

  /// Items of other needed streams wait.
  bool isNeededElsewhere(Stream stream) const {
    for (Stream other = 0; other < streams_.size(); ++other) {
      if (other != stream && streams_[other].needed && streams_[other].size > 0) return true;
    }
    return false;
  }

  Item remove(typename Items::iterator place) {
    Item item = std::move(place->second.item);
    --streams_[place->second.stream].size;
    items_.erase(place);
    return item;
  }

  const SteadyDuration wait_;
  const std::function<void()> on_change_;
  const SteadyClock clock_;

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::vector<StreamState> streams_;
  Items items_;
  ros::Time last_taken_;
  uint64_t pushes_ = 0;
};

/// Stamps that go back by more than this mean a new recording or a loop of it; less is disorder.
constexpr double kTimeJump_s = 0.5;

/// A frame with what its pixels live in.
struct PosedFrame {
  ros::Time stamp;
  std::variant<DepthFrame, ColourFrame> image;
  cv_bridge::CvImageConstPtr pixels;
  std::string frame_id;  ///< Of its camera.
  size_t camera = 0;     ///< Its place among the cameras.
  size_t stream = 0;     ///< Its number in the FrameQueue and the FrameLedger.
};

/// What the pixels of a frame take.
inline size_t bytesOf(const PosedFrame& frame) {
  return std::visit(
      [](const auto& image) { return image.row_bytes * static_cast<size_t>(image.height); },
      frame.image);
}

/// A stream for each camera's depth, and one for its colour. It is their intakes that bound it.
using FrameQueue = MergeQueue<PosedFrame>;

}  // namespace dtsdf
