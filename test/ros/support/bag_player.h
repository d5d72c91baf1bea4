/// Plays part of a bag in simulated time.
#pragma once

#include <ros/param.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace dtsdf {

/// Runs `rosbag play` in the background.
class BagPlayer {
 public:
  /// Plays the test's bag (parameter "~bag") from from_s to to_s, in seconds since its start. Waits
  /// until all its topics have subscribers.
  BagPlayer(double from_s, double to_s) {
    std::string bag;
    ros::param::get("~bag", bag);
    const double start_s = std::max(from_s, 0.0);
    const std::string command = "rosbag play --clock --quiet --wait-for-subscribers --start " +
                                std::to_string(start_s) + " --duration " +
                                std::to_string(to_s - start_s) + " '" + bag + "' < /dev/null";
    pipe_ = popen(command.c_str(), "r");
  }
  BagPlayer(const BagPlayer&) = delete;
  BagPlayer& operator=(const BagPlayer&) = delete;
  /// Waits for the end of playback.
  ~BagPlayer() {
    if (pipe_ != nullptr) pclose(pipe_);
  }

 private:
  FILE* pipe_;
};

}  // namespace dtsdf
