/// The one queue from topics to the map: where messages become frames, wait for their pose and
/// their turn, and are dropped where there is no room.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <ros/time.h>

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "ros/common/pace.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/images.h"

namespace dtsdf {

/// Stamps that jump back by more than this mean a new recording or a loop of it; less is disorder.
constexpr double kTimeJump_s = 0.5;

/// A frame with what its pixels live in.
struct PosedFrame {
  ros::Time stamp;
  std::variant<DepthFrame, ColourFrame> image;
  cv_bridge::CvImageConstPtr pixels;
  Eigen::Isometry3d given_T_W_C = Eigen::Isometry3d::Identity();  ///< Before steps move it.
  std::string frame_id;                                           ///< Of its camera.
  size_t camera = 0;                                              ///< Its place among the cameras.
  FrameAccounting* accounting = nullptr;                          ///< Of its stream.
};

/// Frames of all streams, each a camera's depth or its colour, in the order of stamps, then depth
/// before colour, then of names. Each goes through three states: it waits for the messages of its
/// stamp; it is whole, and waits for its pose; it is posed, and waits for its turn. It has its turn
/// when no other stream can bring an earlier one, or when it has waited for that long enough.
///
/// All that waits is counted in bytes, over all streams. Where there is no room, the oldest frame
/// of the stream with the most bytes is dropped. Every image that is taken is dropped with a
/// reason, or comes out by take(). Thread safe; streams are added first.
class FrameQueue {
 public:
  using Stream = size_t;

  struct Limits {
    size_t images = 30;         ///< Of one stream.
    size_t bytes = 256u << 20;  ///< Of all.
    double merge_wait_s = 0.1;  ///< That a frame waits for earlier ones of other streams.
  };

  struct StreamOptions {
    std::string name;  ///< Orders streams with one stamp.
    /// Colour may never come, so it is waited for from its first frame on only, and may come late.
    bool is_colour = false;
    bool any_info = false;     ///< The latest camera_info will do.
    bool wants_mask = false;   ///< Each image has a mask with its stamp.
    std::string no_info_text;  ///< What is said of an image without camera_info,
    std::string no_mask_text;  ///< and without its mask.
  };

  /// `on_ready` is called when there may be something to take, by the thread that brought it.
  FrameQueue(Limits limits, std::function<void()> on_ready, SteadyClock clock = waitingTime);

  /// `accounting` outlives the queue.
  Stream addStream(StreamOptions options, FrameAccounting& accounting);

  // Input's thread. Messages of one stamp make a frame, in any order of arrival. A frame that is
  // whole drops those of its stream before it that are not.
  void addImage(Stream stream, const sensor_msgs::ImageConstPtr& image) { add(stream, {image}); }
  void addInfo(Stream stream, const sensor_msgs::CameraInfoConstPtr& info) {
    add(stream, {nullptr, info});
  }
  void addMask(Stream stream, const sensor_msgs::ImageConstPtr& mask) {
    add(stream, {nullptr, nullptr, mask});
  }

  /// A frame that is whole, and what its stream notes of it.
  struct Whole {
    CameraImage messages;
    SteadyTime since;
    bool is_checked = false;
    bool may_be_ahead = false;  ///< Its stamp may be wrong, so that it says nothing of the others.
  };
  /// What becomes of a frame: it waits for what a text says, is dropped, or has its pose.
  using Decision = std::variant<std::string, Rejection, PosedFrame>;
  /// Has it decided what becomes of the first frame of a stream that is whole, without the lock.
  /// @return false if there is none, or it waits.
  bool poseFirst(Stream stream, const std::function<Decision(Whole&)>& decide);
  /// Drops a frame that waits for its pose still.
  void dropStamp(Stream stream, const ros::Time& stamp, const Rejection& rejection);

  /// Stamps of a stream have jumped back to this one: drops its frames with later ones.
  void restart(Stream stream, const ros::Time& stamp);

  // Map's thread.
  std::optional<PosedFrame> take();
  bool hasTurn() const { return idleTime() == SteadyDuration::zero(); }
  /// How long until a frame has its turn, if nothing comes meanwhile.
  SteadyDuration idleTime() const;

  // Any thread. While paused, and after end(), frames are dropped, including those that wait.
  void setPaused(bool paused);
  bool isPaused() const;
  void end();

  size_t bytes() const;
  size_t maxBytes() const { return limits_.bytes; }
  /// What the first frame of the stream waits for, in words; empty: for nothing, or its turn.
  std::string waitingFor(Stream stream) const;

 private:
  struct Key {
    ros::Time stamp;
    bool is_colour;
    std::string name;
    uint64_t number;  ///< In the order of arrival.

    bool operator<(const Key& other) const {
      return std::tie(stamp, is_colour, name, number) <
             std::tie(other.stamp, other.is_colour, other.name, other.number);
    }
  };
  enum class State { kIncomplete, kWhole, kPosed };
  struct Entry {
    Stream stream;
    State state = State::kIncomplete;
    Whole whole = {};  ///< It is since when it came, became whole or got its pose.
    PosedFrame posed = {};

    bool hasImage() const { return state == State::kPosed || whole.messages.image != nullptr; }
  };
  using Entries = std::map<Key, Entry>;
  struct StreamState {
    StreamOptions options;
    FrameAccounting* accounting;
    ros::Time heard = {};   ///< No frame of this stamp or before can come.
    bool has_come = false;  ///< A posed frame of it.
    size_t taken = 0;
    sensor_msgs::CameraInfoConstPtr latest_info = nullptr;
    std::string waiting_for = {};
    size_t seen_waiting = 0, seen_taken = 0;  ///< The backlog once it had taken so many.
    int behind = 0;                           ///< So often in a row the backlog had not shrunk.
    bool is_overloaded = false;               ///< Until none waits.

    bool isWaitedFor() const { return !options.is_colour || has_come; }
  };

  // All but add() with mutex_ held.
  void add(Stream stream, const CameraImage& message);
  Entries::iterator find(Stream stream, State state, std::optional<ros::Time> stamp = std::nullopt);
  static size_t bytesOf(const Entry& entry);
  std::optional<DropReason> missingOf(const Entry& entry) const;
  bool completeIfWhole(Entries::iterator place);
  void apply(Entries::iterator place, Decision decision);
  template <class Wanted>
  Entries::iterator firstThat(const Wanted& wanted);
  template <class Wanted>
  Entries::iterator firstArrived(const Wanted& wanted);
  void drop(Entries::iterator place, const Rejection& rejection);
  void dropIncomplete(Entries::iterator place);
  template <class Wanted>
  void dropAll(const Rejection& rejection, const Wanted& wanted);
  void makeRoom();
  size_t imagesOf(Stream stream) const;
  Stream mostServed(Stream stream) const;
  void dropOldest(Stream stream);
  void dropColourUpTo(ros::Time stamp);
  void shorten(Stream stream);
  bool canComeBefore(const ros::Time& stamp) const;
  bool isTooLate(Stream stream, const ros::Time& stamp) const;
  SteadyDuration timeToTurn() const;
  Entries::const_iterator firstPosed() const;

  const Limits limits_;
  const std::function<void()> on_ready_;
  const SteadyClock clock_;

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::vector<StreamState> streams_;
  Entries entries_;
  uint64_t arrivals_ = 0;
  ros::Time last_taken_;
  bool is_paused_ = false, is_ending_ = false;
};

}  // namespace dtsdf
