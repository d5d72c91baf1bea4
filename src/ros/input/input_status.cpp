#include "ros/input/input_status.h"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/status_fields.h"
#include "ros/input/images.h"

namespace dtsdf {

using dtsdf_mapping::DropCount;

namespace {

constexpr std::chrono::seconds kWindow{30};
/// Of fewer images than that no share of drops is reported.
constexpr uint64_t kLeastImages = 50;
constexpr size_t kMostMoments = 600;
/// Silence of so many times `status/stale_s` is an error.
constexpr double kErrorAfter = 3.0;
/// Colour may start later than depth.
constexpr double kColourPatience_s = 10.0;
/// A publisher that is not connected to by then cannot be.
constexpr double kConnectPatience_s = 3.0;

DropShare shareOf(const StreamReport& before, const StreamReport& now) {
  DropShare share;
  share.received = now.received - before.received;
  uint64_t most = 0;
  for (int i = 0; i < kDropReasonCount; ++i) {
    const uint64_t dropped = now.dropped_by[i] - before.dropped_by[i];
    const auto reason = static_cast<DropReason>(i);
    if (!isFault(reason)) continue;
    share.dropped += dropped;
    if (dropped > most) {
      most = dropped;
      share.most_common = reason;
    }
  }
  return share;
}

std::vector<DropCount> dropCounts(const StreamReport& stream) {
  std::vector<DropCount> counts;
  for (int i = 0; i < kDropReasonCount; ++i) {
    if (stream.dropped_by[i] == 0) continue;
    counts.push_back(dropCount(toString(static_cast<DropReason>(i)), stream.dropped_by[i]));
  }
  return counts;
}

void fillCounts(const InputReport& input, MapStatus& status) {
  StreamReport sum;
  for (const StreamReport& stream : input.streams) {
    if (!stream.isColour()) {
      for (int i = 0; i < kDropReasonCount; ++i) sum.dropped_by[i] += stream.dropped_by[i];
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
  status.transforms_refused = input.transforms.refused;
  status.transform_restarts = input.transforms.restarts;
  status.transform_age_s = ageOf(input.transforms.age_s);
}

/// "'/a' and '/b'".
std::string inQuotes(const std::vector<std::string>& topics) {
  std::string text;
  for (const std::string& topic : topics) {
    text += (text.empty() ? "'" : " and '") + printable(topic) + "'";
  }
  return text;
}

/// "; depth is published on '/a' and '/b'"; empty without topics.
std::string describeOthers(const char* what, const std::vector<std::string>& topics) {
  return topics.empty() ? "" : std::string("; ") + what + " is published on " + inQuotes(topics);
}

/// Why no depth images come. @param publisher As findPublisher() has it.
std::string describeNoPublisher(const std::string& topic, const PublishedTopics& topics,
                                const std::string& publisher) {
  if (!publisher.empty()) {
    return "it is published by " + printable(publisher) +
           ", which cannot be reached: set ROS_HOSTNAME or ROS_IP on both machines";
  }
  for (const std::string& other : topics.depth) {
    if (other == topic) return "it is published, but not connected to yet";
    const std::string image = withoutTransport(other);
    if (image != withoutTransport(topic)) continue;
    if (other == image) return "it is published as sensor_msgs/Image; set image_transport:=raw";
    return "it is published as sensor_msgs/CompressedImage; set image_transport:=" +
           other.substr(image.size() + 1);
  }
  return "it has no publisher" + describeOthers("depth", topics.depth);
}

/// @param age_s -1: it has not happened yet.
std::string ago(float age_s) {
  return age_s < 0.0f ? "never" : std::to_string(std::lround(age_s)) + " s ago";
}

/// Drops that are worth a word, though most frames are fused. Of fewer images than that a single
/// drop would be.
void judgeDrops(const DropShare& recent, const std::string& last_drop, const std::string& name,
                MapStatus& status) {
  constexpr double kReportedShare = 0.02;
  const double share = static_cast<double>(recent.dropped) /
                       static_cast<double>(std::max<uint64_t>(1, recent.received));
  if (recent.received < kLeastImages || share <= kReportedShare) return;
  const std::string remedy = remedyFor(recent.most_common);
  report(status, MapStatus::WARN, MapStatus::SOME_DROPPED,
         name + std::to_string(std::lround(100.0 * share)) +
             " % of the depth images were dropped lately, most as " + toString(recent.most_common) +
             ": " + (remedy.empty() ? last_drop : remedy));
}

/// Colour that is required, or comes and cannot be used.
void judgeColour(const StreamReport& colour, const std::string& name, MapStatus& status) {
  if (colour.fused > 0) return;
  if (colour.received == 0) {
    if (!colour.is_needed) return;
    return report(status, MapStatus::WARN, MapStatus::NO_COLOUR,
                  name + "no colour image received on '" + colour.topic +
                      "', which colour/enabled: always requires");
  }
  if (colour.camera_infos == 0) {
    return report(
        status, MapStatus::WARN, MapStatus::COLOUR_NOT_PAINTED,
        name + "colour images are received, but no camera_info on '" + colour.info_topic + "'");
  }
  if (colour.droppedSum() == 0) return;
  report(status, MapStatus::WARN, MapStatus::COLOUR_NOT_PAINTED,
         name + "no colour image painted yet: " + colour.last_drop);
}

}  // namespace

PublishedTopics findPublishedTopics() {
  XmlRpc::XmlRpcValue arguments, result, topics;
  arguments[0] = ros::this_node::getName();
  arguments[1] = "";
  constexpr bool kWaitForMaster = false;
  if (!ros::master::execute("getPublishedTopics", arguments, result, topics, kWaitForMaster)) {
    return {};
  }
  PublishedTopics published;
  std::set<std::string> raw;
  for (int i = 0; i < topics.size(); ++i) {
    if (topics[i][1] == "sensor_msgs/Image") raw.insert(topics[i][0]);
  }
  for (int i = 0; i < topics.size(); ++i) {
    const std::string topic = topics[i][0], type = topics[i][1], image = withoutTransport(topic);
    const auto has = [&](const char* part) { return topic.find(part) != std::string::npos; };
    if (type == "sensor_msgs/CameraInfo" && !endsWith(topic, "/rendered/camera_info")) {
      published.camera_info.push_back(topic);
    }
    const bool is_depth = has("depth");
    if (!is_depth && !has("color") && !has("colour") && !has("rgb")) continue;
    const bool is_compressed = type == "sensor_msgs/CompressedImage" && image != topic &&
                               raw.count(image) == 0 && (is_depth || !has("compressedDepth"));
    if (type != "sensor_msgs/Image" && !is_compressed) continue;
    (is_depth ? published.depth : published.colour).push_back(topic);
  }
  for (auto* const list : {&published.depth, &published.colour, &published.camera_info}) {
    std::sort(list->begin(), list->end());
  }
  return published;
}

std::string findPublisher(const std::string& topic) {
  XmlRpc::XmlRpcValue arguments, result, state, uri;
  arguments[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", arguments, result, state, false)) return "";
  for (int i = 0; i < state[0].size(); ++i) {
    if (static_cast<std::string&>(state[0][i][0]) != topic) continue;
    const std::string node = state[0][i][1][0];
    arguments[1] = node;
    std::string host;
    uint32_t port = 0;
    if (ros::master::execute("lookupNode", arguments, result, uri, false)) {
      ros::network::splitURI(uri, host, port);
    }
    return node + " on host " + host;
  }
  return "";
}

void InputStatus::fill(const InputReport& input, MapStatus& status) {
  run_clock_.update(input.at, input.now, input.paused);
  fillCounts(input, status);
  addMemory(status, "images", kHost, input.waiting_bytes, input.max_waiting_bytes);
  status.paused = input.paused;
  const std::vector<DropShare> recent = updateDrops(input);
  const std::vector<StreamReport>& before =
      moments_[moments_.size() - std::min<size_t>(2, moments_.size())].second;
  for (size_t i = 0; i < input.streams.size() && !input.paused; ++i) {
    if (!input.streams[i].isColour()) judgeCamera(input, i, recent[i], before[i], status);
  }
  if (input.paused) report(status, MapStatus::OK, MapStatus::PAUSED, "paused");
  if (run_clock_.timeStands() && status.frames_fused > 0) {
    report(status, MapStatus::OK, MapStatus::TIME_STANDS,
           "mapping; no new images: /clock is not advancing (the bag ended or is paused)");
  }
  if (input.transforms.restarts > restarts_before_) {
    report(
        status, MapStatus::WARN, MapStatus::TRANSFORMS_RESTARTED,
        input.transforms.last_restart +
            ": all transforms were discarded, and are received again; look for a publisher with a "
            "wrong clock, or of a frame that another one publishes");
  }
  restarts_before_ = input.transforms.restarts;
  hintAtColour(input, status);
}

std::vector<DropShare> InputStatus::updateDrops(const InputReport& input) {
  moments_.emplace_back(input.at, input.streams);
  // Of slow images, so many that a share means something.
  const auto isOld = [&](const Moment& moment) {
    uint64_t images = 0;
    for (size_t i = 0; i < input.streams.size(); ++i) {
      images += moments_.back().second[i].received - moment.second[i].received;
    }
    return input.at - moment.first >= kWindow &&
           (images >= kLeastImages || moments_.size() > kMostMoments);
  };
  while (moments_.size() > 2 && isOld(moments_[1])) moments_.pop_front();
  std::vector<DropShare> shares;
  for (size_t i = 0; i < input.streams.size(); ++i) {
    shares.push_back(shareOf(moments_.front().second[i], moments_.back().second[i]));
  }
  return shares;
}

void InputStatus::judgeCamera(const InputReport& input, size_t index, const DropShare& recent,
                              const StreamReport& before, MapStatus& status) const {
  const StreamReport& depth = input.streams[index];
  const std::string name = depth.camera.empty() ? "" : depth.camera + ": ";
  if (judgeSilence(depth, recent, name, input, status)) return;
  if (depth.fused == 0) return judgeNoFrame(depth, name, status);
  if (depth.droppedSum() - before.droppedSum() > depth.fused - before.fused) {
    const std::string remedy = recent.dropped > 0 ? remedyFor(recent.most_common) : "";
    report(status, MapStatus::WARN, MapStatus::MOST_DROPPED,
           name + "most frames are dropped: " + depth.last_drop +
               (remedy.empty() ? "" : "; " + remedy));
  }
  if (!depth.warning.empty()) {
    report(status, MapStatus::WARN, MapStatus::DOUBTFUL_INPUT, name + depth.warning);
  }
  judgeDrops(recent, depth.last_drop, name, status);
  const bool has_colour = index + 1 < input.streams.size() && input.streams[index + 1].isColour();
  if (has_colour) judgeColour(input.streams[index + 1], name, status);
}

/// For how long nothing has come while it could have; 0 if nothing ever has.
double InputStatus::silence(float age_s) const {
  return age_s < 0.0f ? 0.0 : std::min<double>(age_s, run_clock_.ran_s());
}

/// An input that has fallen silent, or of which nothing is fused any longer.
bool InputStatus::judgeSilence(const StreamReport& depth, const DropShare& recent,
                               const std::string& name, const InputReport& input,
                               MapStatus& status) const {
  const double no_image_s = silence(depth.received_age_s);
  const double silent_s = std::max(no_image_s, silence(depth.fused_age_s));
  if (stale_s_ <= 0.0 || silent_s < stale_s_) return false;
  const bool has_images = no_image_s < stale_s_;
  if (has_images && recent.dropped > 0 && recent.most_common == DropReason::kLost) return false;
  const std::string publisher = depth.image_publishers == 0 ? " (its publisher is gone)" : "";
  const std::string what = has_images
                               ? "no frame is fused: " + depth.last_drop
                               : "no depth image is received on '" + depth.topic + "'" + publisher;
  report(status, silent_s < kErrorAfter * stale_s_ ? MapStatus::WARN : MapStatus::ERROR,
         has_images ? MapStatus::NOT_FUSED : MapStatus::SILENT,
         name + what + "; last image " + ago(depth.received_age_s) + ", last transform " +
             ago(ageOf(input.transforms.age_s)) + ", last fused frame " + ago(depth.fused_age_s));
  return true;
}

/// No frame has become part of the map.
void InputStatus::judgeNoFrame(const StreamReport& depth, const std::string& name,
                               MapStatus& status) const {
  if (depth.received == 0) {
    return report(
        status, MapStatus::WARN, MapStatus::NO_IMAGES,
        name + "no depth image received on '" + depth.topic + "': " +
            (depth.image_publishers == 0
                 ? describeNoPublisher(depth.topic, find_topics_(), publisherOf(depth.topic))
                 : "its publisher has sent nothing yet"));
  }
  if (depth.camera_infos == 0) {
    const std::vector<std::string> infos = find_topics_().camera_info;
    return report(status, MapStatus::WARN, MapStatus::NO_CAMERA_INFO,
                  name + "depth images are received, but no camera_info on '" + depth.info_topic +
                      "'" + describeOthers("camera_info", infos) +
                      (infos.empty() ? "" : "; set camera_info:="));
  }
  const std::string why = depth.waiting_for.empty() ? depth.last_drop : depth.waiting_for;
  if (!why.empty()) {
    return report(status, MapStatus::WARN, MapStatus::NO_FRAME_YET,
                  name + "no frame fused yet: " + why);
  }
  report(status, MapStatus::OK, MapStatus::NO_FRAME_YET,
         name + "waiting for the first frame with its camera_info and transform");
}

/// That colour is published, but not on the topic that is waited for. Most depth cameras come
/// without colour, so a map without is no trouble; but who set a wrong topic would never learn why
/// the mesh is grey.
void InputStatus::hintAtColour(const InputReport& input, MapStatus& status) {
  for (size_t i = 1; i < input.streams.size(); ++i) {
    const StreamReport& colour = input.streams[i];
    const bool is_silent = colour.received == 0 && colour.image_publishers == 0;
    // Colour that is required is a matter of the verdict.
    if (!colour.isColour() || colour.is_needed || !is_silent) continue;
    if (input.streams[i - 1].fused == 0 || run_clock_.ran_s() < kColourPatience_s) continue;
    if (!colour_topics_) colour_topics_ = find_topics_().colour;
    if (colour_topics_->empty()) continue;
    const std::string& wanted = colour.topic;
    const auto same = std::find_if(colour_topics_->begin(), colour_topics_->end(),
                                   [&](const auto& t) { return withoutTransport(t) == wanted; });
    report(status, MapStatus::OK, MapStatus::NO_COLOUR,
           "mapping; no colour image received on '" + wanted + "': it has no publisher; " +
               (same != colour_topics_->end()
                    ? "it is published compressed; set color_image_transport:=compressed"
                    : "colour is published on " + inQuotes(*colour_topics_) + " (color:=)"));
  }
}

/// After a while in which the node would have reached it.
std::string InputStatus::publisherOf(const std::string& topic) const {
  return run_clock_.ran_s() < kConnectPatience_s ? "" : find_publisher_(topic);
}

}  // namespace dtsdf
