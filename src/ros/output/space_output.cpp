#include "ros/output/space_output.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "map/memory_budget.h"
#include "ros/common/callback_guard.h"
#include "space/space_map.h"

namespace dtsdf {
namespace {

/// Nobody wakes the thread for a new listener, nor when one has read.
constexpr std::chrono::milliseconds kUntilListeners{50};
/// No memory, most likely: to try again at once would not help.
constexpr std::chrono::milliseconds kAfterSpaceError{1000};

/// Of cells and distances, with map/page_folder: as much as of the map's, up to this.
size_t mostCellBytes(const MapperParams& params) {
  return std::min(budgetOf(params).free_bytes, size_t{64} << 20);
}

GroundHeights heightsOf(const GroundParams& ground) {
  return {ground.min_height_m, ground.max_height_m, ground.grid_seen_share};
}

/// The map's thread and the output's have something left.
int halfOfTheCores() {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / 2);
}

}  // namespace

SpaceOutput::SpaceOutput(const ros::NodeHandle& nh, const MappingParams& params,
                         SpaceHandover& handover)
    : handover_(handover),
      slice_height_m_(params.node.ground.slice_height_m),
      follower_(params.mapper.space.max_distance_m, halfOfTheCores(),
                makePages(params.mapper, mostCellBytes(params.mapper))),
      grid_(nh, frameOfMap(params.node), heightsOf(params.node.ground)),
      slice_(nh, frameOfMap(params.node), slice_height_m_),
      pace_(params.node.publish.space_rate_hz) {}

std::chrono::milliseconds SpaceOutput::step() noexcept {
  return guarded("output of space", [this] { work(); }) ? kUntilListeners : kAfterSpaceError;
}

void SpaceOutput::work() {
  takeChanges();
  meetListeners();
  const SteadyTime now = std::chrono::steady_clock::now();
  if (is_outdated_ && (is_another_ || pace_.isDue(now))) publish();
  grid_.serve(now);
  slice_.serve();
  std::vector<TopicStatus> topics = grid_.report();
  topics.push_back(slice_.report());
  const std::lock_guard<std::mutex> lock(mutex_);
  topics_ = std::move(topics);
  bytes_ = follower_.bytes() + grid_.bytes();
  pages_ = follower_.pageStats();
}

void SpaceOutput::takeChanges() {
  const std::optional<SpaceDelivery> delivery = handover_.take();
  if (!delivery) return;
  if (has_grid_listeners_) grid_.apply(delivery->changes, delivery->cell_size_m, delivery->stamp);
  follower_.apply(delivery->changes, delivery->cell_size_m);
  keep(delivery->stamp);
  is_outdated_ = true;
  is_another_ = is_another_ || delivery->changes.begins_anew;
}

void SpaceOutput::keep(const ros::Time& stamp) {
  StampedSpace now{follower_.snapshot(), stamp};
  const std::lock_guard<std::mutex> lock(mutex_);
  std::swap(newest_, now);
}

/// Who listens first gets what is there; what nobody listens to is forgotten.
void SpaceOutput::meetListeners() {
  const bool had_grid_listeners = std::exchange(has_grid_listeners_, grid_.listeners() > 0);
  const bool had_slice_listeners = std::exchange(has_slice_listeners_, slice_.listeners() > 0);
  if (!has_grid_listeners_) grid_.forget();
  if (!has_slice_listeners_) slice_.forget();
  const StampedSpace now = newest();
  if (now.space->isEmpty()) return;
  const bool is_grid_new = has_grid_listeners_ && !had_grid_listeners;
  if (is_grid_new) {
    grid_.apply({true, {}}, now.space->cellSize_m(), now.stamp);
    now.space->visitCubes([&](std::vector<SpaceCube> cubes) {
      grid_.apply({false, std::move(cubes)}, now.space->cellSize_m(), now.stamp);
    });
  }
  if (is_grid_new || (has_slice_listeners_ && !had_slice_listeners)) {
    is_outdated_ = is_another_ = true;
  }
}

/// Rests as long as it took, for others that share the cores.
void SpaceOutput::publish() {
  const SteadyTime begin = std::chrono::steady_clock::now();
  is_outdated_ = is_another_ = false;
  if (has_grid_listeners_) grid_.renew(begin);
  if (has_slice_listeners_) {
    const StampedSpace now = newest();
    std::vector<SliceCell> cells;
    if (!now.space->isEmpty()) cells = sliceAt(*now.space, slice_height_m_);
    slice_.put({std::move(cells), now.space->cellSize_m(), now.stamp});
  }
  const SteadyTime end = std::chrono::steady_clock::now();
  pace_.begin(begin);
  pace_.restUntil(end + (end - begin));
}

StampedSpace SpaceOutput::newest() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return newest_;
}

void SpaceOutput::addTo(OutputReport& report) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  report.space_topics = topics_;
  report.space_bytes = bytes_;
  report.paged_space = pages_;
}

}  // namespace dtsdf
