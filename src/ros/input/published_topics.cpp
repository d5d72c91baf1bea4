#include "ros/input/published_topics.h"

#include <ros/master.h>
#include <ros/this_node.h>

#include <algorithm>
#include <map>

#include "params/printable.h"
#include "params/text.h"
#include "ros/input/image_kind.h"

namespace dtsdf {
namespace {

/// What this package itself publishes, with the views of its maps.
constexpr char kOfViews[] = "/rendered/camera_info";

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

/// Images by their topic, and whether they are published as they are, not only compressed.
using Images = std::map<std::string, bool>;

void add(const std::string& topic, const std::string& type, const std::string& transport,
         Images& images) {
  if (type == "sensor_msgs/Image") images[topic] = true;
  if (type == "sensor_msgs/CompressedImage" && endsWith(topic, transport)) {
    images.emplace(topic.substr(0, topic.size() - transport.size()), false);
  }
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
  Images depth, colour;
  for (int i = 0; i < topics.size(); ++i) {
    const std::string topic = topics[i][0], type = topics[i][1];
    if (type == "sensor_msgs/CameraInfo") {
      if (!endsWith(topic, kOfViews)) published.camera_info.push_back(topic);
    } else if (contains(topic, "depth")) {
      add(topic, type, kCompressedDepthTopic, depth);
    } else if (contains(topic, "color") || contains(topic, "colour") || contains(topic, "rgb")) {
      add(topic, type, kCompressedTopic, colour);
    }
  }
  std::sort(published.camera_info.begin(), published.camera_info.end());
  for (const auto& [topic, as_it_is] : depth) {
    published.depth.push_back(topic);
    if (!as_it_is) published.only_compressed.push_back(topic);
  }
  for (const auto& [topic, as_it_is] : colour) published.colour.push_back(topic);
  return published;
}

std::string inQuotes(const std::vector<std::string>& topics) {
  std::string text;
  for (const std::string& topic : topics) {
    text += (text.empty() ? "'" : " and '") + printable(topic) + "'";
  }
  return text;
}

}  // namespace dtsdf
