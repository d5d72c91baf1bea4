#include "ros/input/depth_topics.h"

#include <ros/master.h>
#include <ros/this_node.h>

#include <set>

#include "params/ending.h"
#include "ros/input/compressed_image.h"

namespace dtsdf {
namespace {

/// The image's topic; empty for topics of other kinds.
std::string imageTopicOf(const std::string& topic, const std::string& type) {
  if (topic.find("depth") == std::string::npos) return "";
  if (type == "sensor_msgs/Image") return topic;
  if (type != "sensor_msgs/CompressedImage" || !endsWith(topic, kCompressedDepthTopic)) return "";
  return topic.substr(0, topic.size() - std::string(kCompressedDepthTopic).size());
}

}  // namespace

std::vector<std::string> findDepthTopics() {
  XmlRpc::XmlRpcValue arguments, result, topics;
  arguments[0] = ros::this_node::getName();
  arguments[1] = "";
  constexpr bool kWaitForMaster = false;
  if (!ros::master::execute("getPublishedTopics", arguments, result, topics, kWaitForMaster)) {
    return {};
  }
  std::set<std::string> found;
  for (int i = 0; i < topics.size(); ++i) {
    const std::string topic = imageTopicOf(topics[i][0], topics[i][1]);
    if (!topic.empty()) found.insert(topic);
  }
  return {found.begin(), found.end()};
}

}  // namespace dtsdf
