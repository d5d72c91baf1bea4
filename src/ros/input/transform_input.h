/// Subscribes the transforms.
#pragma once

#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <tf2_msgs/TFMessage.h>

#include "ros/input/transform_buffer.h"

namespace dtsdf {

/// Callbacks come by the queue of the node handle, on one thread. Static transforms are subscribed
/// anew where the buffer had no room for one that it needs by now.
class TransformInput {
 public:
  /// `transforms` outlives it.
  TransformInput(const ros::NodeHandle& nh, TransformBuffer& transforms);

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  void onTransforms(const Event& event);
  void onStaticTransforms(const Event& event);
  void put(const Event& event, bool is_static);
  void subscribeStatic();

  ros::NodeHandle nh_;
  TransformBuffer& transforms_;
  ros::Time last_now_;
  ros::Subscriber tf_, tf_static_;
  ros::WallTimer timer_;
};

}  // namespace dtsdf
