#include "ros/support/status_watcher.h"

#include "ros/support/wait.h"

namespace dtsdf {

StatusWatcher::StatusWatcher(ros::NodeHandle nh) {
  subscriber_ = nh.subscribe<dtsdf_mapping::MapStatus>(
      "/mapping/status", 10, [this](const dtsdf_mapping::MapStatus::ConstPtr& status) {
        status_ = *status;
        received_ = true;
      });
}

uint64_t StatusWatcher::dropped(const std::string& reason) const {
  for (const dtsdf_mapping::DropCount& drop : status_.dropped) {
    if (drop.reason == reason) return drop.count;
  }
  return 0;
}

bool StatusWatcher::waitForDrop(const std::string& reason, uint64_t before) const {
  return waitUntil([&] { return dropped(reason) > before; });
}

bool StatusWatcher::waitForFused(uint64_t count) const {
  return waitUntil([&] { return status_.frames_fused >= count; });
}

}  // namespace dtsdf
