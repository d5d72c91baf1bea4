#include "ros/steps/space.h"

#include <dtsdf_mapping/GetDistances.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/console.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <stdexcept>
#include <thread>
#include <utility>

#include "map/memory_budget.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"
#include "space/space_map.h"

namespace dtsdf {
namespace {

/// Until an update may be due after a grid.
constexpr std::chrono::milliseconds kUntilNext{50};

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

SpaceChanges allChangesOf(Space& space) {
  SpaceChanges all = space.takeChanges();
  while (all.is_part) {
    const SpaceChanges more = space.takeChanges();
    all.cubes.insert(all.cubes.end(), more.cubes.begin(), more.cubes.end());
    all.is_part = more.is_part;
  }
  return all;
}

void warnOfSize(const GridBox& window) {
  ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                 "occupancy_grid would have "
                                     << window.width << " x " << window.height
                                     << " cells, more than " << GroundGrid::kMostColumns
                                     << ", so it keeps its present part; use larger cells "
                                        "(space/cell_voxels) or map/keep_radius_m, and look for "
                                        "frames with wrong poses");
}

sensor_msgs::PointCloud2 sliceCloud(const std::vector<SliceCell>& cells, double cell_size_m,
                                    double height_m) {
  sensor_msgs::PointCloud2 cloud;
  cloud.height = 1;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(4, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "intensity", 1,
                                kFloat);
  modifier.resize(cells.size());
  sensor_msgs::PointCloud2Iterator<float> next(cloud, "x");
  for (const SliceCell& cell : cells) {
    const Eigen::Vector3f p = pointInSlice(cell, cell_size_m, height_m).cast<float>();
    next[0] = p.x();
    next[1] = p.y();
    next[2] = p.z();
    next[3] = cell.distance_m;
    ++next;
  }
  return cloud;
}

}  // namespace

void SpaceQueue::add(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (changes.begins_anew) {
    waiting_.changes.begins_anew = true;
    cubes_.clear();
  }
  for (const SpaceCube& cube : changes.cubes) {
    cubes_[packKey(SpaceCube::cubeOf(cube.first))] = cube;
  }
  has_changes_ = true;
  waiting_.cell_size_m = cell_size_m;
  waiting_.stamp = stamp;
}

bool SpaceQueue::isFull() const {
  constexpr size_t kMostWaiting = size_t{1} << 15;  // cubes: some megabytes
  const std::lock_guard<std::mutex> lock(mutex_);
  return cubes_.size() >= kMostWaiting;
}

void SpaceQueue::clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (waiting_.cell_size_m == 0.0) return;  // nothing was ever known
  cubes_.clear();
  has_changes_ = waiting_.changes.begins_anew = true;
  waiting_.stamp = ros::Time();
}

std::optional<SpaceQueue::Delivery> SpaceQueue::take() {
  Delivery delivery;
  decltype(cubes_) cubes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!std::exchange(has_changes_, false)) return std::nullopt;
    delivery = waiting_;
    waiting_.changes.begins_anew = false;
    cubes.swap(cubes_);
  }
  delivery.changes.cubes.reserve(cubes.size());
  for (const auto& [key, cube] : cubes) delivery.changes.cubes.push_back(cube);
  return delivery;
}

SpaceStep::SpaceStep(const Host& host)
    : host_(host), is_on_(host.params.mapper.space.enabled), pace_(host.rates.space_hz) {
  if (!is_on_) return;
  const MapperParams& params = host.params.mapper;
  follower_ = std::make_unique<SpaceFollower>(params.space.max_distance_m, halfOfTheCores(),
                                              makePages(params, mostCellBytes(params)));
}

void SpaceStep::advertise(const Handles& handles) {
  server_ = serve<dtsdf_mapping::GetDistances>(
      handles.prompt, "get_distances", [this](const auto& request, auto& response) {
        checkPoints(request.points);
        const Eigen::Isometry3d T_W_F =
            host_.frame.find(request.header.frame_id, request.header.stamp);
        if (!is_on_) {
          throw std::runtime_error(
              "the map does not record free space; start the node with space/enabled");
        }
        host_.map.throwIfFailed();  // the last frame may be in the map in part
        const Known known = this->known();
        if (known.space->isEmpty()) {
          throw std::runtime_error(
              "nothing is mapped yet since the start, clear_map or load_map; ask again once a "
              "frame was fused and meshed");
        }
        fillAnswer(*known.space, request.points, T_W_F, response);
        response.stamp = known.stamp;
      });
  if (!is_on_) return;
  grids_.advertise<nav_msgs::OccupancyGrid>(handles.prompt, "occupancy_grid", 1);
  updates_.advertise<map_msgs::OccupancyGridUpdate>(handles.prompt, "occupancy_grid_updates", 1);
  slices_.advertise<sensor_msgs::PointCloud2>(handles.prompt, "distance_slice", 1);
}

std::optional<double> SpaceStep::meshRate_hz() const {
  if (!is_on_) return std::nullopt;
  return std::max<double>(host_.rates.space_hz, kLeastSpaceRate_hz);
}

Step::Work SpaceStep::hasWork() const {
  return is_part_ && !queue_.isFull() ? Work::kWhenIdle : Work::kNone;
}

/// As an extraction may be finished after one more frame, cells may be free by a later frame than
/// surfaces are of; the stamp promises only what has surfaces too. Of much, a part, and more once
/// that was taken.
void SpaceStep::handOver() {
  Space* const space = host_.map.mapper().space();
  if (space == nullptr) return;
  is_part_ = true;
  if (queue_.isFull()) return;
  const SpaceChanges changes = space->takeChanges();
  is_part_ = changes.is_part;
  queue_.add(changes, space->cellSize_m(), host_.map.meshStamp());
}

void SpaceStep::replaced(const Replacement& replacement) {
  if (!is_on_) return;
  is_part_ = false;
  if (replacement.kind != Replacement::Kind::kCorrected) return queue_.clear();
  // All at once, so that planners are answered by the space of before until there is the new one.
  Space* const space = host_.map.mapper().space();
  if (space != nullptr) {
    queue_.add(allChangesOf(*space), space->cellSize_m(), host_.map.meshStamp());
  }
}

SteadyDuration SpaceStep::publish(ShownMesh*) {
  if (!is_on_) return SteadyDuration::max();
  takeChanges();
  meetListeners();
  const SteadyTime now = std::chrono::steady_clock::now();
  pace_.setRate(host_.rates.space_hz, now);
  if (is_outdated_ && (is_another_ || pace_.isDue(now))) renew(now);
  if (grid_ && grid_->window()) {
    if (std::exchange(is_grid_due_, false)) publishGrid(now);
    if (update_pace_.isDue(now)) publishUpdate(now);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  bytes_ = follower_->bytes() + (grid_ ? grid_->bytes() : 0);
  pages_ = follower_->pageStats();
  return kUntilNext;
}

void SpaceStep::takeChanges() {
  const std::optional<SpaceQueue::Delivery> delivery = queue_.take();
  if (!delivery) return;
  if (grid_) grid_->apply(delivery->changes, delivery->cell_size_m);
  follower_->apply(delivery->changes, delivery->cell_size_m);
  Known now{follower_->snapshot(), delivery->stamp};
  is_outdated_ = true;
  is_another_ = is_another_ || delivery->changes.begins_anew;
  const std::lock_guard<std::mutex> lock(mutex_);
  std::swap(known_, now);
}

/// Who begins to listen gets all there is; a grid that nobody listens to is forgotten.
void SpaceStep::meetListeners() {
  const bool is_followed = grids_.isFollowed() || updates_.isFollowed();
  const bool is_reader_new = grids_.takeNewcomer();
  const bool is_grid_new = updates_.takeNewcomer() || is_reader_new;
  const bool is_slice_new = slices_.takeNewcomer();
  if (!is_followed) grid_.reset();
  is_grid_due_ = is_grid_due_ || (is_followed && is_grid_new);
  const Known now = known();
  if (now.space->isEmpty()) return;
  if (is_followed && !grid_) {
    grid_.emplace(heightsOf(host_.params.node.ground));
    grid_->apply({true, {}}, now.space->cellSize_m());
    now.space->visitCubes([&](std::vector<SpaceCube> cubes) {
      grid_->apply({false, std::move(cubes)}, now.space->cellSize_m());
    });
  }
  if (is_grid_new || is_slice_new) is_outdated_ = is_another_ = true;
}

/// Rests as long as it took, for others that share the cores.
void SpaceStep::renew(SteadyTime now) {
  is_outdated_ = is_another_ = false;
  if (grid_) {
    const GroundGrid::Pending pending = grid_->next();
    if (grid_->tooLarge()) warnOfSize(*grid_->tooLarge());
    if (pending == GroundGrid::Pending::kGrid) is_grid_due_ = true;
    if (pending == GroundGrid::Pending::kUpdate) update_pace_.noteChange();
  }
  if (slices_.isFollowed()) publishSlice();
  const SteadyTime end = std::chrono::steady_clock::now();
  pace_.begin(now);
  pace_.restUntil(end + (end - now));
}

void SpaceStep::publishGrid(SteadyTime now) {
  const GridBox& window = *grid_->window();
  nav_msgs::OccupancyGrid grid;
  grid.header.frame_id = frameOfMap(host_.params.node);
  grid.header.stamp = grid.info.map_load_time = known().stamp;
  grid.info.resolution = static_cast<float>(grid_->cellSize_m());
  grid.info.width = static_cast<uint32_t>(window.width);
  grid.info.height = static_cast<uint32_t>(window.height);
  grid.info.origin.position.x = window.x * grid_->cellSize_m();
  grid.info.origin.position.y = window.y * grid_->cellSize_m();
  grid.info.origin.orientation.w = 1.0;
  grid.data = grid_->values(window);
  grids_.publish(grid);
  update_pace_.startOver(now);
}

void SpaceStep::publishUpdate(SteadyTime now) {
  const bool is_whole = update_pace_.takeUpdate(now);
  const GridBox& box = is_whole ? *grid_->window() : grid_->changed();
  if (box.isEmpty() || !updates_.isFollowed()) return;
  map_msgs::OccupancyGridUpdate update;
  update.header.frame_id = frameOfMap(host_.params.node);
  update.header.stamp = known().stamp;
  update.x = box.x - grid_->window()->x;
  update.y = box.y - grid_->window()->y;
  update.width = static_cast<uint32_t>(box.width);
  update.height = static_cast<uint32_t>(box.height);
  update.data = grid_->values(box);
  updates_.publish(update);
}

void SpaceStep::publishSlice() {
  const Known now = known();
  const double height_m = host_.params.node.ground.slice_height_m;
  std::vector<SliceCell> cells;
  if (!now.space->isEmpty()) cells = sliceAt(*now.space, height_m);
  sensor_msgs::PointCloud2 cloud = sliceCloud(cells, now.space->cellSize_m(), height_m);
  cloud.header.frame_id = frameOfMap(host_.params.node);
  cloud.header.stamp = now.stamp;
  slices_.publish(cloud);
}

SpaceStep::Known SpaceStep::known() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return known_;
}

void SpaceStep::fill(MapStatus& status) {
  if (!is_on_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const Topic* topic : {&grids_, &updates_, &slices_}) {
    status.topics.push_back(topic->status());
  }
  addMemory(status, "space", kHost, bytes_);
  addPages(status, pages_);
  if (pages_.lost == 0) return;
  report(
      status, MapStatus::WARN, MapStatus::CELLS_LOST,
      std::to_string(pages_.lost) +
          " sectors of cells and distances for planners could not be read back: " + pages_.problem);
}

}  // namespace dtsdf
