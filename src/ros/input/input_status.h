/// The input's part of the status: what was received, fused and dropped, and why nothing is fused.
#pragma once

#include <ros/master.h>
#include <ros/this_node.h>
#include <ros/time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/pace.h"
#include "ros/common/status_fields.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/images.h"
#include "ros/input/transforms.h"

namespace dtsdf {

/// Message types keyed by topic. Leaves out topics published by mapping nodes that look like input
/// topics.
using PublishedTopics = std::map<std::string, std::string>;

/// Asks the master, without retries; empty if it does not answer.
inline PublishedTopics findPublishedTopics() {
  XmlRpc::XmlRpcValue arguments, result, topics;
  arguments[0] = ros::this_node::getName();
  arguments[1] = "";
  if (!ros::master::execute("getPublishedTopics", arguments, result, topics, false)) return {};
  PublishedTopics published;
  for (int i = 0; i < topics.size(); ++i) {
    const std::string topic = topics[i][0], type = topics[i][1];
    const bool is_of_map = endsWith(topic, "/rendered/camera_info") ||
                           endsWith(topic, "/surface_points") || endsWith(topic, "/distance_slice");
    if (!is_of_map) published[topic] = type;
  }
  return published;
}

/// Writes the input's part of the status, except transforms and memory. Not thread-safe.
class InputStatus {
 public:
  /// @param stale_s See NodeParams.
  /// @param find_topics Finds topics to suggest if a subscribed topic has no publisher.
  explicit InputStatus(double stale_s, PublishedTopics (*find_topics)() = findPublishedTopics)
      : stale_s_(stale_s), find_topics_(find_topics) {}

  /// @pre The transforms' part of `status` is filled.
  /// @param streams For each camera, depth and then colour if it is used. @param now ROS time.
  void fill(const std::vector<StreamReport>& streams, bool paused, SteadyTime at,
            const ros::Time& now, MapStatus& status) {
    updateClock(at, now, paused);
    status.paused = paused;
    fillCounts(streams, status);
    addToHistory(at, streams);
    for (size_t i = 0; i < streams.size() && !paused; ++i) {
      if (!streams[i].isColour()) reportCamera(streams, i, status);
    }
    if (paused) report(status, MapStatus::OK, MapStatus::PAUSED, "paused");
    if (is_time_stopped_ && status.frames_fused > 0) {
      report(status, MapStatus::OK, MapStatus::TIME_STANDS,
             "mapping; no new images: /clock is not advancing (the bag ended or is paused)");
    }
  }

 private:
  using TimedReports = std::pair<SteadyTime, std::vector<StreamReport>>;

  static std::vector<dtsdf_mapping::DropCount> dropCounts(const StreamReport& stream) {
    std::vector<dtsdf_mapping::DropCount> counts;
    for (const auto& [reason, count] : stream.dropped_by) {
      counts.emplace_back();
      counts.back().reason = reason.name;
      counts.back().count = count;
    }
    return counts;
  }

  static void fillCounts(const std::vector<StreamReport>& streams, MapStatus& status) {
    StreamReport sum;
    for (const StreamReport& stream : streams) {
      if (!stream.isColour()) {
        for (const auto& [reason, count] : stream.dropped_by) sum.dropped_by[reason] += count;
        status.images_received += stream.received;
        status.frames_fused += stream.fused;
        status.last_fused_stamp = std::max(status.last_fused_stamp, stream.last_fused_stamp);
        status.frames_waiting += stream.waiting;
        status.cameras.emplace_back();
        status.cameras.back().name = stream.camera;
      }
      status.cameras.back().streams.push_back(stream);
      status.cameras.back().streams.back().dropped = dropCounts(stream);
    }
    status.frames_dropped = sum.droppedSum();
    status.dropped = dropCounts(sum);
  }

  /// While mapping is paused or simulated time stands still, no images are expected. Silence is
  /// measured from the end of that time.
  void updateClock(SteadyTime at, const ros::Time& now, bool paused) {
    if (history_.empty() || now != now_) changed_at_ = at;
    now_ = now;
    // A slow simulator advances time in steps, which do not count as a standstill. Time is 0 until
    // the first message on /clock, which never comes if /use_sim_time is still set from an earlier
    // bag.
    is_time_stopped_ = !now.isZero() && at - changed_at_ >= std::chrono::seconds(1);
    if (history_.empty() || paused || is_time_stopped_) begun_ = at;
    expected_s_ = toSeconds(at - begun_);
  }

  /// Keeps the reports of the last half minute.
  void addToHistory(SteadyTime at, const std::vector<StreamReport>& streams) {
    constexpr std::chrono::seconds kWindow{30};
    history_.emplace_back(at, streams);
    while (history_.size() > 2 && at - history_[1].first >= kWindow) history_.pop_front();
  }

  void reportCamera(const std::vector<StreamReport>& streams, size_t index,
                    MapStatus& status) const {
    const StreamReport& depth = streams[index];
    const std::string name = depth.camera.empty() ? "" : depth.camera + ": ";
    const auto warn = [&](uint8_t code, const std::string& text) {
      report(status, MapStatus::WARN, code, name + text);
    };
    // Number and most common reason of the recent drops that are faults.
    const StreamReport& first = history_.front().second[index];
    uint64_t dropped = 0, most = 0;
    DropReason most_common = drop::kQueueFull;
    for (const auto& [reason, count] : depth.dropped_by) {
      const auto before = first.dropped_by.find(reason);
      const uint64_t recent_count = count - (before == first.dropped_by.end() ? 0 : before->second);
      if (!reason.is_fault) continue;
      dropped += recent_count;
      if (recent_count > most) most_common = reason;
      most = std::max(most, recent_count);
    }
    const bool is_lost = dropped > 0 && most_common == drop::kLost;
    if (reportSilence(depth, is_lost, name, status)) return;
    if (depth.fused == 0) return reportNoFrame(depth, name, status);
    if (!depth.warning.empty()) warn(MapStatus::DOUBTFUL_INPUT, depth.warning);
    // Fractions of dropped images above this are reported.
    constexpr double kReportedShare = 0.02;
    const uint64_t received = depth.received - first.received;
    const double share = static_cast<double>(dropped) / static_cast<double>(received);
    if (received >= kMinImages && share > kReportedShare) {
      std::string remedy = most_common.remedy;
      if (remedy.empty() && depth.last_reason == most_common) remedy = depth.last_drop;
      warn(MapStatus::SOME_DROPPED, std::to_string(std::lround(100.0 * share)) +
                                        " % of the latest depth images were dropped, mostly as " +
                                        most_common.name + (remedy.empty() ? "" : ": " + remedy));
    }
    if (index + 1 == streams.size() || !streams[index + 1].isColour()) return;
    // Reports colour that is required but missing, or that cannot be used.
    const StreamReport& colour = streams[index + 1];
    if (colour.fused > 0) return;
    if (colour.received == 0 && colour.is_needed) {
      warn(MapStatus::NO_COLOUR, "no colour image received on '" + colour.topic +
                                     "', which colour/enabled: always requires");
    } else if (colour.received > 0 && colour.camera_infos == 0) {
      warn(MapStatus::COLOUR_NOT_PAINTED,
           "colour images are received, but no camera_info on '" + colour.info_topic + "'");
    } else if (colour.droppedSum() > 0) {
      warn(MapStatus::COLOUR_NOT_PAINTED, "no colour image painted yet: " + colour.last_drop);
    }
  }

  /// Reports that images no longer arrive, or are no longer fused. @return whether it reported
  /// anything.
  bool reportSilence(const StreamReport& depth, bool is_lost, const std::string& name,
                     MapStatus& status) const {
    // Age of the last event, at most the time for which events have been expected; 0 if there was
    // no event.
    const auto silence = [this](float age_s) {
      return age_s < 0.0f ? 0.0 : std::min<double>(age_s, expected_s_);
    };
    const auto ago = [](double age_s) {
      return age_s < 0.0 ? "never" : std::to_string(std::lround(age_s)) + " s ago";
    };
    const double no_image_s = silence(depth.received_age_s);
    const double silent_s = std::max(no_image_s, silence(depth.fused_age_s));
    if (stale_s_ <= 0.0 || silent_s < stale_s_) return false;
    const bool has_images = no_image_s < stale_s_;
    if (has_images && is_lost) return false;
    const std::string publisher = depth.image_publishers == 0 ? " (its publisher is gone)" : "";
    const std::string what =
        has_images ? "no frame is fused: " + whyNotFused(depth)
                   : "no depth image is received on '" + depth.topic + "'" + publisher;
    constexpr double kErrorAfter = 3.0;
    report(status, silent_s < kErrorAfter * stale_s_ ? MapStatus::WARN : MapStatus::ERROR,
           has_images ? MapStatus::NOT_FUSED : MapStatus::SILENT,
           name + what + "; last image " + ago(depth.received_age_s) + ", last transform " +
               ago(status.transform_age_s) + ", last fused frame " + ago(depth.fused_age_s));
    return true;
  }

  static std::string whyNotFused(const StreamReport& depth) {
    return depth.waiting_for.empty() ? depth.last_drop : depth.waiting_for;
  }

  /// Reports why no frame has been fused yet.
  void reportNoFrame(const StreamReport& depth, const std::string& name, MapStatus& status) const {
    const std::string why = whyNotFused(depth);
    if (depth.received == 0) {
      report(status, MapStatus::WARN, MapStatus::NO_IMAGES,
             name + "no depth image received on '" + depth.topic + "': " +
                 (depth.image_publishers == 0 ? whyNoPublisher(depth)
                                              : "its publisher has sent nothing yet"));
    } else if (depth.camera_infos == 0 && !depth.is_cloud) {
      const std::string others = suggestTopics(find_topics_(), "camera_info", "CameraInfo");
      report(status, MapStatus::WARN, MapStatus::NO_CAMERA_INFO,
             name + "depth images are received, but no camera_info on '" + depth.info_topic + "'" +
                 others + (others.empty() ? "" : "; set camera_info:="));
    } else {
      report(status, why.empty() ? MapStatus::OK : MapStatus::WARN, MapStatus::NO_FRAME_YET,
             name + (why.empty() ? "waiting for the first frame" : "no frame fused yet: " + why));
    }
  }

  /// Why no depth images arrive.
  std::string whyNoPublisher(const StreamReport& depth) const {
    const PublishedTopics topics = find_topics_();
    const std::string image = withoutTransport(depth.topic);
    const char* const kCloud = "sensor_msgs/PointCloud2";
    const auto same = topics.find(depth.topic);
    if (same != topics.end() && (same->second == kCloud) == depth.is_cloud) {
      return "it is published, but not received; if this lasts, set ROS_HOSTNAME or ROS_IP on "
             "both machines";
    }
    for (const auto& [topic, type] : topics) {
      if (withoutTransport(topic) != image) continue;
      const std::string transport = type == kCloud   ? "cloud"
                                    : topic == image ? "raw"
                                                     : topic.substr(image.size() + 1);
      return "it is published as " + type + "; set image_transport:=" + transport;
    }
    const std::string images = suggestTopics(topics, "depth", "Image", "depth");
    return "it has no publisher" +
           (depth.is_cloud || images.empty()
                ? suggestTopics(topics, "a cloud (image_transport:=cloud)", "PointCloud2")
                : images);
  }

  /// Text such as "; depth is published on '/a' and '/b'", which lists the topics whose type and
  /// name contain these parts, without transport suffixes; empty if there are none.
  static std::string suggestTopics(const PublishedTopics& topics, const std::string& what,
                                   const char* part_of_type, const char* part_of_name = "") {
    std::set<std::string> names;
    for (const auto& [topic, type] : topics) {
      const bool is_match = type.find(part_of_type) != std::string::npos &&
                            topic.find(part_of_name) != std::string::npos;
      if (is_match) names.insert("'" + printable(withoutTransport(topic)) + "'");
    }
    if (names.empty()) return "";
    return "; " + what + " is published on " + joined({names.begin(), names.end()}, " and ");
  }

  /// Minimum number of images for reporting the fraction that was dropped.
  static constexpr uint64_t kMinImages = 20;

  const double stale_s_;
  PublishedTopics (*const find_topics_)();
  SteadyTime begun_{}, changed_at_{};  ///< Start of expecting images; last change of now_.
  ros::Time now_;
  bool is_time_stopped_ = false;
  double expected_s_ = 0.0;           ///< How long frames have been expected.
  std::deque<TimedReports> history_;  ///< Recent reports, oldest first.
};

}  // namespace dtsdf
