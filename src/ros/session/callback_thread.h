/// A callback queue with a thread of its own: what is called there may wait, and holds up nobody
/// but its caller.
#pragma once

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

namespace dtsdf {

class CallbackThread {
 public:
  /// A node handle whose callbacks are called on this thread.
  ros::NodeHandle serve(ros::NodeHandle nh) {
    nh.setCallbackQueue(&queue_);
    return nh;
  }

  void start() { spinner_.start(); }

  /// Waits for the callback under way; nothing is called any more.
  void stop() { spinner_.stop(); }

 private:
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace dtsdf
