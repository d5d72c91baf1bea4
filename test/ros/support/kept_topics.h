/// Publishers that stay advertised until the test program ends.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <string>

namespace dtsdf {

/// Keeps a topic advertised after the end of its test. A topic that disappears and immediately
/// returns can crash its subscriber: roscpp reconnects after 100 ms and throws bad_weak_ptr if the
/// master reports at that moment that the topic is gone (docs/reliability.md).
ros::Publisher keepTopic(const ros::Publisher& publisher);

/// Releases all kept topics. Must be called before ROS shuts down.
void releaseKeptTopics();

/// Advertises a topic until the program ends.
template <class Message>
ros::Publisher advertiseUntilExit(ros::NodeHandle nh, const std::string& topic) {
  return keepTopic(nh.advertise<Message>(topic, 100));
}

}  // namespace dtsdf
