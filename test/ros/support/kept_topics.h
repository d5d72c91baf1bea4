/// Topics that a test program advertises until it ends, as soon as a test needs them.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <string>

namespace dtsdf {

/// Keeps a publisher's topic after the end of its test. A topic that disappears and returns at once
/// can crash its subscriber: roscpp reconnects 100 ms later, and throws bad_weak_ptr if it learns
/// just then from the master that the topic is gone (docs/reliability.md).
ros::Publisher keepTopic(const ros::Publisher& publisher);

/// Releases all kept topics. Must be called before ROS shuts down.
void releaseKeptTopics();

/// Advertises a topic that stays until the program ends.
template <class Message>
ros::Publisher advertiseUntilExit(ros::NodeHandle nh, const std::string& topic) {
  return keepTopic(nh.advertise<Message>(topic, 100));
}

}  // namespace dtsdf
