#include "ros/output/space_output.h"

#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {
namespace {

/// Nobody wakes the thread for a new listener, nor when one has read.
constexpr std::chrono::milliseconds kIdle{50};
/// No memory, most likely: to try again at once would not help.
constexpr std::chrono::milliseconds kAfterSpaceError{1000};

}  // namespace

SpaceOutput::SpaceOutput(const ros::NodeHandle& nh, const Options& options, SpaceHandover& handover)
    : handover_(handover),
      grid_(nh, options.map_frame, options.heights),
      slice_(nh, options.map_frame, options.slice_height_m) {}

std::chrono::milliseconds SpaceOutput::step() noexcept {
  return guarded("output of space", [this] { work(); }) ? kIdle : kAfterSpaceError;
}

void SpaceOutput::work() {
  const bool has_grid_listeners = grid_.listeners() > 0;
  const bool has_slice_listeners = slice_.listeners() > 0;
  if (!has_grid_listeners) grid_.forget();
  if (!has_slice_listeners) slice_.forget();
  handover_.want(has_grid_listeners, has_slice_listeners);
  const SpaceDelivery delivery = handover_.take();
  if (delivery.changes) grid_.apply(*delivery.changes, delivery.cell_size_m, delivery.stamp);
  if (delivery.slice) slice_.put(*delivery.slice);
  grid_.serve(std::chrono::steady_clock::now());
  slice_.serve();
  std::vector<TopicReport> topics = grid_.report();
  topics.push_back(slice_.report());
  const std::lock_guard<std::mutex> lock(report_mutex_);
  topics_ = std::move(topics);
  grid_bytes_ = grid_.bytes();
}

void SpaceOutput::addTo(OutputReport& report) const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report.space_topics = topics_;
  report.grid_bytes = grid_bytes_;
}

}  // namespace dtsdf
