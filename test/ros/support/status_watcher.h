/// Subscribes to the node's status.
#pragma once

#include <dtsdf_mapping/MapStatus.h>
#include <ros/node_handle.h>

#include <string>

namespace dtsdf {

class StatusWatcher {
 public:
  explicit StatusWatcher(ros::NodeHandle nh);

  const dtsdf_mapping::MapStatus& status() const { return status_; }
  bool received() const { return received_; }

  /// Number of frames dropped for this reason so far.
  uint64_t dropped(const std::string& reason) const;

  /// Waits until more than `before` frames have been dropped for this reason.
  bool waitForDrop(const std::string& reason, uint64_t before) const;
  bool waitForFused(uint64_t count) const;

 private:
  dtsdf_mapping::MapStatus status_;
  bool received_ = false;
  ros::Subscriber subscriber_;
};

}  // namespace dtsdf
