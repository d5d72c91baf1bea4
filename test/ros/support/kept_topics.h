/// Topics that a test program has from the first test that needs them until it ends.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <string>

namespace dtsdf {

/// Keeps the topic of a publisher when the test that has it ends. A topic that goes and is back at
/// once can end its listener: roscpp connects again by itself 100 ms later, and throws
/// bad_weak_ptr if the master's word that it was gone comes just then (docs/reliability.md).
ros::Publisher keepTopic(const ros::Publisher& publisher);

/// Before ROS ends.
void giveUpKeptTopics();

/// A publisher of a topic that is kept.
template <class Message>
ros::Publisher advertiseKept(ros::NodeHandle nh, const std::string& topic) {
  return keepTopic(nh.advertise<Message>(topic, 100));
}

}  // namespace dtsdf
