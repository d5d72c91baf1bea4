#include "ros/node/status.h"

#include <ros/console.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

#include "ros/common/callback_guard.h"
#include "ros/common/status_fields.h"

namespace dtsdf {

namespace {

/// The fields of a message as it prints itself, line by line: those of its parts lie deeper, below
/// a line that has a name and no value.
void addFields(const MapStatus& status, diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
  std::stringstream text;
  text.imbue(std::locale::classic());
  text << status;
  std::vector<std::pair<size_t, std::string>> parts;  // by their depth
  for (std::string line; std::getline(text, line);) {
    const size_t depth = line.find_first_not_of(' '), colon = line.find(": ");
    if (colon == std::string::npos) continue;
    while (!parts.empty() && parts.back().first >= depth) parts.pop_back();
    std::string name = parts.empty() ? "" : parts.back().second + "/";
    name += line.substr(depth, colon - depth);
    if (colon + 2 == line.size()) {
      parts.emplace_back(depth, name);
    } else {
      diagnostics.add(name, line.substr(colon + 2));
    }
  }
}

/// Resident memory of this process; 0 where the system does not report it.
uint64_t residentBytes() {
  std::ifstream statm("/proc/self/statm");
  uint64_t all_pages = 0, resident_pages = 0;
  if (!(statm >> all_pages >> resident_pages)) return 0;
  return resident_pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

StatusPublisher::StatusPublisher(const ros::NodeHandle& nh, ros::NodeHandle private_nh,
                                 std::string map_frame, double rate_hz,
                                 std::function<void(MapStatus&)> fill)
    : map_frame_(std::move(map_frame)),
      fill_(std::move(fill)),
      updater_(nh, private_nh, private_nh.getNamespace()) {
  updater_.setHardwareID("none");
  updater_.add("mapping", [this](diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
    diagnostics.summary(status_.level, status_.message);
    addFields(status_, diagnostics);
  });
  // Latched: a tool that asks once gets the answer at once.
  publisher_ = private_nh.advertise<MapStatus>("status", 1, true);
  publish();  // before the timer, which another thread may serve
  timer_ = private_nh.createWallTimer(
      ros::WallDuration(1.0 / rate_hz),
      [this](const ros::WallTimerEvent&) { guarded("status", [this] { publish(); }); });
}

void StatusPublisher::publish() {
  MapStatus status;
  fill_(status);
  addMemory(status, "process", kHost, residentBytes());
  status.header.frame_id = map_frame_;
  status.header.stamp = ros::Time::now();
  status_ = std::move(status);
  publisher_.publish(status_);
  const SteadyTime now = std::chrono::steady_clock::now();
  if (trouble_log_.update(status_.level == MapStatus::OK, status_.code, now)) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", status_.message);
  }
  // Its own timer would wait for simulated time.
  updater_.force_update();
}

}  // namespace dtsdf
