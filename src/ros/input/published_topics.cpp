#include "ros/input/published_topics.h"

#include <ros/master.h>
#include <ros/this_node.h>

#include <algorithm>
#include <iterator>
#include <set>

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

/// Images by their topic, with and without what compressed ones append to it.
class NamesOfImages {
 public:
  explicit NamesOfImages(const char* ending) : ending_(ending) {}

  void add(const std::string& topic, const std::string& type) {
    if (type == "sensor_msgs/Image") as_they_are_.insert(topic);
    if (type == "sensor_msgs/CompressedImage" && endsWith(topic, ending_)) {
      compressed_.insert(topic.substr(0, topic.size() - ending_.size()));
    }
  }

  std::vector<std::string> all() const {
    std::set<std::string> names = as_they_are_;
    names.insert(compressed_.begin(), compressed_.end());
    return {names.begin(), names.end()};
  }

  std::vector<std::string> onlyCompressed() const {
    std::vector<std::string> names;
    std::set_difference(compressed_.begin(), compressed_.end(), as_they_are_.begin(),
                        as_they_are_.end(), std::back_inserter(names));
    return names;
  }

 private:
  std::string ending_;
  std::set<std::string> as_they_are_, compressed_;
};

}  // namespace

PublishedTopics findPublishedTopics() {
  XmlRpc::XmlRpcValue arguments, result, topics;
  arguments[0] = ros::this_node::getName();
  arguments[1] = "";
  constexpr bool kWaitForMaster = false;
  if (!ros::master::execute("getPublishedTopics", arguments, result, topics, kWaitForMaster)) {
    return {};
  }
  NamesOfImages depth(kCompressedDepthTopic), colour(kCompressedTopic);
  std::set<std::string> camera_info;
  for (int i = 0; i < topics.size(); ++i) {
    const std::string topic = topics[i][0], type = topics[i][1];
    if (type == "sensor_msgs/CameraInfo") {
      if (!endsWith(topic, kOfViews)) camera_info.insert(topic);
    } else if (contains(topic, "depth")) {
      depth.add(topic, type);
    } else if (contains(topic, "color") || contains(topic, "colour") || contains(topic, "rgb")) {
      colour.add(topic, type);
    }
  }
  return {
      depth.all(), depth.onlyCompressed(), colour.all(), {camera_info.begin(), camera_info.end()}};
}

std::string inQuotes(const std::vector<std::string>& topics) {
  std::string text;
  for (const std::string& topic : topics) {
    text += (text.empty() ? "'" : " and '") + printable(topic) + "'";
  }
  return text;
}

}  // namespace dtsdf
