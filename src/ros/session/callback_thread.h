/// A callback queue with a thread of its own: what is called there may wait, and holds up nobody
/// but its caller.
#pragma once

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <cstdint>

namespace dtsdf {

class CallbackThread {
 public:
  /// More threads than one where a caller has to be noticed while another one waits.
  explicit CallbackThread(uint32_t threads = 1) : spinner_(threads, &queue_) {}

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
  ros::AsyncSpinner spinner_;
};

}  // namespace dtsdf
