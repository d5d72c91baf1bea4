/// What the status says of the input: what came, what became of it, and why nothing is fused if
/// nothing is.
#pragma once

#include <dtsdf_mapping/MapStatus.h>
#include <ros/time.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/common/pace.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/transforms.h"

namespace dtsdf {

/// Sorted, each once.
struct PublishedTopics {
  /// Images with "depth" in their name; what is only compressed with the ending of its transport.
  std::vector<std::string> depth;
  std::vector<std::string> colour;  ///< The same with "color", "colour" or "rgb", and not "depth".
  std::vector<std::string> camera_info;  ///< Without those of views of maps.
};

/// Asks the master, and waits for it no longer than for its answer; empty without one.
PublishedTopics findPublishedTopics();

/// Who publishes a topic, and where: "/play on host robot123"; empty: nobody.
std::string findPublisher(const std::string& topic);

/// Since when frames could have come: what is silent in a pause is no fault. Updated at each
/// status; wall time. While mapping is paused or simulated time stands still, nothing is expected
/// to come, and afterwards the waiting begins again.
class RunClock {
 public:
  void update(SteadyTime at, const ros::Time& now, bool paused) {
    if (!has_begun_ || now != now_) changed_at_ = at;
    now_ = now;
    // Simulated time comes in steps: that of a slow simulator is not at a stand at once.
    stands_ = at - changed_at_ >= std::chrono::seconds(1);
    if (!has_begun_ || paused || stands_) begun_ = at;
    has_begun_ = true;
    ran_s_ = toSeconds(at - begun_);
  }

  /// How long there was neither a pause nor a stand of time.
  double ran_s() const { return ran_s_; }
  bool timeStands() const { return stands_; }

 private:
  bool has_begun_ = false;
  SteadyTime begun_{}, changed_at_{};
  ros::Time now_;
  bool stands_ = false;
  double ran_s_ = 0.0;
};

/// Of one stream, within the last while.
struct DropShare {
  uint64_t received = 0;
  uint64_t dropped = 0;  ///< For reasons that are a fault: not as mapping is paused.
  DropReason most_common = DropReason::kQueueFull;
};

/// The input at one moment.
struct InputReport {
  std::vector<StreamReport> streams;  ///< Of each camera depth, and then colour where it is wanted.
  TransformReport transforms;
  size_t waiting_bytes = 0, max_waiting_bytes = 0;
  bool paused = false;
  SteadyTime at;
  ros::Time now;  ///< ROS's clock.
};

/// Writes the input's part of the status, one after the other: it remembers what was reported.
class InputStatus {
 public:
  /// @param stale_s See StatusParams. @param find_topics Those that could be meant where one has no
  /// publisher.
  explicit InputStatus(double stale_s, PublishedTopics (*find_topics)() = findPublishedTopics,
                       std::string (*find_publisher)(const std::string&) = findPublisher)
      : stale_s_(stale_s), find_topics_(find_topics), find_publisher_(find_publisher) {}

  void fill(const InputReport& input, dtsdf_mapping::MapStatus& status);

 private:
  using Moment = std::pair<SteadyTime, std::vector<StreamReport>>;

  /// Of each stream, in their order.
  std::vector<DropShare> updateDrops(const InputReport& input);
  void judgeCamera(const InputReport& input, size_t index, const DropShare& recent,
                   const StreamReport& before, dtsdf_mapping::MapStatus& status) const;
  bool judgeSilence(const StreamReport& depth, const DropShare& recent, const std::string& name,
                    const InputReport& input, dtsdf_mapping::MapStatus& status) const;
  void judgeNoFrame(const StreamReport& depth, const std::string& name,
                    dtsdf_mapping::MapStatus& status) const;
  double silence(float age_s) const;
  void hintAtColour(const InputReport& input, dtsdf_mapping::MapStatus& status);
  std::string publisherOf(const std::string& topic) const;

  const double stale_s_;
  PublishedTopics (*const find_topics_)();
  std::string (*const find_publisher_)(const std::string&);
  RunClock run_clock_;
  std::deque<Moment> moments_;  ///< Of the last while.
  uint64_t restarts_before_ = 0;
  std::optional<std::vector<std::string>> colour_topics_;  ///< Once they were asked for.
};

}  // namespace dtsdf
