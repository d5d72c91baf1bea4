/// The step that serves the map's free-space grid to planners: publishes a ground grid, its updates
/// and slices of distances, and answers queries.
#pragma once

#include <dtsdf_mapping/GetDistanceGrid.h>
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

#include "dtsdf_mapping/space.h"
#include "map/memory_budget.h"
#include "params/text.h"
#include "planning/ground_grid.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/common/topic.h"
#include "ros/input/conversions.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/step.h"
#include "space/distance_grid.h"
#include "space/space_follower.h"
#include "space/space_map.h"

namespace dtsdf {

/// If space/enabled is false, publishes nothing and refuses queries. Queries never wait for the
/// map. Changes go from the map thread to the output thread through a queue; when the queue is
/// full, further changes stay in the map.
class SpaceStep : public Step {
 public:
  explicit SpaceStep(const Host& host)
      : host_(host), is_on_(host.params.mapper.space.enabled), pace_(host.space_hz) {
    if (!is_on_) return;
    const MapperParams& params = host.params.mapper;
    // With map/page_folder, the cells and distances for planners may take as much memory as the
    // map's own cells, but at most 64 MiB.
    const size_t most_bytes = std::min(freeBudgetOf(params), size_t{64} << 20);
    // Leaves half of the cores to the rest of the node.
    const int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / 2);
    follower_ = std::make_unique<SpaceFollower>(params.space.max_distance_m, threads,
                                                makePages(params, most_bytes));
  }

  void advertise(const Handles& handles) override {
    server_ = serve<dtsdf_mapping::GetDistances>(
        handles.query, "get_distances",
        [this](const auto& request, auto& response) { answer(request, response); });
    grid_server_ = serve<dtsdf_mapping::GetDistanceGrid>(
        handles.waiting, "get_distance_grid",
        [this](const auto& request, auto& response) { answerGrid(request, response); });
    if (!is_on_) return;
    grids_.advertise<nav_msgs::OccupancyGrid>(handles.prompt, "occupancy_grid", 1);
    updates_.advertise<map_msgs::OccupancyGridUpdate>(handles.prompt, "occupancy_grid_updates", 1);
    slices_.advertise<sensor_msgs::PointCloud2>(handles.prompt, "distance_slice", 1);
  }

  std::optional<double> meshRate_hz() const override {
    if (!is_on_) return std::nullopt;
    return std::max<double>(host_.space_hz, kMinSpaceRate_hz);
  }

  void meshed() override { handOver(); }
  bool work(bool frame_waits) override {
    if (frame_waits || !is_part_ || isFull()) return false;
    handOver();
    return true;
  }

  void replaced(const MapContents*, const std::shared_ptr<const MapChunks>&) override {
    is_part_ = false;
    if (const Space* const space = host_.map.mapper().space()) add({true, {}}, *space);
  }

  /// Queues all changes at once, so that planners get answers from the previous free-space grid
  /// until the new one is complete.
  void corrected() override {
    is_part_ = false;
    Space* const space = host_.map.mapper().space();
    if (space == nullptr) return;
    SpaceChanges changes{true, {}};
    do changes.is_part = addTo(changes, space->takeChanges());
    while (changes.is_part);
    add(std::move(changes), *space);
  }

  SteadyDuration publish(ShownMesh*) override {
    if (!is_on_) return SteadyDuration::max();
    takeChanges();
    handleNewListeners();
    const SteadyTime now = std::chrono::steady_clock::now();
    pace_.setRate(host_.space_hz, now);
    if (is_outdated_ && (publish_now_ || pace_.isDue(now))) updateOutputs(now);
    if (grid_ && grid_->window()) {
      if (std::exchange(is_grid_due_, false)) publishGrid(now);
      if (is_update_due_ && now - grid_at_ >= kUpdateGap) publishUpdate(now);
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    bytes_ = follower_->bytes() + (grid_ ? grid_->bytes() : 0);
    pages_ = follower_->pageStats();
    // Shorter than kUpdateGap, so that the update after a grid is not late.
    constexpr std::chrono::milliseconds kUntilNext{50};
    return kUntilNext;
  }

  void fill(MapStatus& status) override {
    if (!is_on_) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    addMemory(status, "space", kHost, bytes_);
    addPages(status, pages_, "sectors of cells and distances for planners");
  }

  struct Known {
    std::shared_ptr<const SpaceSnapshot> space = std::make_shared<const SpaceSnapshot>();
    /// Stamp of the newest frame whose surfaces are in `space`; newer frames may already have freed
    /// cells. 0 if no frame was fused, as in a loaded map.
    ros::Time stamp;
  };
  Known known() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return known_;
  }

 private:
  void answer(const dtsdf_mapping::GetDistances::Request& request,
              dtsdf_mapping::GetDistances::Response& response) const {
    constexpr size_t kMaxPoints = 100000;
    if (request.points.size() > kMaxPoints) {
      throw std::runtime_error(
          formatted("%zu points are more than the %zu allowed per call; split the call",
                    request.points.size(), kMaxPoints));
    }
    const Eigen::Isometry3d T_W_F = host_.frame.find(request.header.frame_id, request.header.stamp);
    const auto [space, stamp] = knownToPlanners();
    const Eigen::Matrix3d R_F_W = T_W_F.linear().transpose();
    for (const geometry_msgs::Point& point : request.points) {
      const Eigen::Vector3d p_F(point.x, point.y, point.z);
      if (!p_F.allFinite()) throw std::runtime_error("a point is not finite; leave it out");
      const SpaceDistance distance = space->distanceAt(T_W_F * p_F);
      const Vec3f& g = distance.gradient;
      response.known.push_back(distance.known ? 1 : 0);
      response.distances.push_back(distance.distance_m);
      tf2::toMsg(R_F_W * Eigen::Vector3d(g.x, g.y, g.z), response.gradients.emplace_back());
    }
    response.stamp = stamp;
  }

  void answerGrid(const dtsdf_mapping::GetDistanceGrid::Request& request,
                  dtsdf_mapping::GetDistanceGrid::Response& response) const {
    // More shapes could take minutes, and shutting down waits for them.
    constexpr size_t kMaxShapes = 1000;
    if (request.cleared_boxes.size() + request.cleared_spheres.size() > kMaxShapes) {
      throw std::runtime_error(formatted("at most %zu shapes can be cleared per call", kMaxShapes));
    }
    const Eigen::Isometry3d T_W_F = host_.frame.find(request.header.frame_id, request.header.stamp);
    const auto box = readBox(request.box, T_W_F);
    if (!box) throw std::runtime_error("the box has no size; set box.size, in metres");
    std::vector<Region> cleared;
    for (const auto& shape : request.cleared_boxes) {
      cleared.push_back(readRegion(shape, {}, T_W_F));
    }
    for (const auto& shape : request.cleared_spheres) {
      cleared.push_back(readRegion({}, shape, T_W_F));
    }
    const auto [space, stamp] = knownToPlanners();
    const PointGrid grid =
        gridIn(*box, request.resolution != 0.0 ? request.resolution : space->cellSize_m());
    const Eigen::Matrix3d R_F_W = T_W_F.linear().transpose();
    GridDistances answer = cleared.empty()
                               ? distancesOn(grid, *space, R_F_W)
                               : distancesOn(grid, clearedIn(*box, cleared, *space), R_F_W);
    std::copy(grid.size.begin(), grid.size.end(), response.size.begin());
    response.resolution = grid.resolution_m;
    response.origin = tf2::toMsg(T_W_F.inverse() * grid.T_W_G);
    response.distances = std::move(answer.distances_m);
    response.gradients = std::move(answer.gradients);
    response.stamp = stamp;
  }

  /// @throws std::runtime_error if space/enabled is false, the backend has failed or nothing is
  /// mapped.
  Known knownToPlanners() const {
    if (!is_on_) {
      throw std::runtime_error(
          "the map does not record free space; start the node with space/enabled: true");
    }
    host_.map.throwIfFailed();  // the last frame may be half fused
    Known known = this->known();
    if (!known.space->isEmpty()) return known;
    throw std::runtime_error(
        "nothing is mapped yet: no frame has been fused and meshed since the start, clear_map or "
        "load_map; try again later");
  }

  bool isFull() const {
    constexpr size_t kMaxWaiting = size_t{1} << 15;  // cubes; they take a few megabytes
    const std::lock_guard<std::mutex> lock(mutex_);
    return waiting_ && waiting_->cubes.size() >= kMaxWaiting;
  }

  /// Adds `more` to `changes`. @return whether the map has further changes.
  static bool addTo(SpaceChanges& changes, SpaceChanges more) {
    if (more.begins_anew) changes = {true, {}};
    changes.cubes.insert(changes.cubes.end(), more.cubes.begin(), more.cubes.end());
    return more.is_part;
  }

  void add(SpaceChanges changes, const Space& space) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!waiting_) waiting_.emplace();
    addTo(*waiting_, std::move(changes));
    waiting_cell_m_ = space.cellSize_m();
    waiting_stamp_ = host_.map.meshStamp();
  }

  /// Queues changes, or a part of them if there are many. Their stamp is that of the newest frame
  /// in the mesh. Frames fused after this frame may already have freed some cells.
  void handOver() {
    Space* const space = host_.map.mapper().space();
    if (space == nullptr) return;
    is_part_ = true;
    if (isFull()) return;
    SpaceChanges changes = space->takeChanges();
    is_part_ = changes.is_part;
    add(std::move(changes), *space);
  }

  void takeChanges() {
    std::optional<SpaceChanges> changes;
    double cell_m = 0.0;
    Known now;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      changes.swap(waiting_);
      cell_m = waiting_cell_m_;
      now.stamp = waiting_stamp_;
    }
    if (!changes) return;
    if (grid_) grid_->apply(*changes, cell_m);
    follower_->apply(*changes, cell_m);
    now.space = follower_->snapshot();
    is_outdated_ = true;
    publish_now_ = publish_now_ || changes->begins_anew;
    const std::lock_guard<std::mutex> lock(mutex_);
    std::swap(known_, now);
  }

  /// Schedules the whole grid and slice for new listeners, and deletes the grid when nobody
  /// listens.
  void handleNewListeners() {
    const bool is_followed = grids_.hasSubscribers() || updates_.hasSubscribers();
    const bool is_reader_new = grids_.takeNewSubscriber();
    const bool is_grid_new = updates_.takeNewSubscriber() || is_reader_new;
    const bool is_slice_new = slices_.takeNewSubscriber();
    if (!is_followed) grid_.reset();
    is_grid_due_ = is_grid_due_ || (is_followed && is_grid_new);
    const std::shared_ptr<const SpaceSnapshot> space = known().space;
    if (space->isEmpty()) return;
    if (is_followed && !grid_) {
      const NodeParams& params = host_.params;
      grid_.emplace(params.min_height_m, params.max_height_m, params.grid_seen_share);
      grid_->apply({true, {}}, space->cellSize_m());
      space->visitCubes([&](std::vector<SpaceCube> cubes) {
        grid_->apply({false, std::move(cubes)}, space->cellSize_m());
      });
    }
    if (is_grid_new || is_slice_new) is_outdated_ = publish_now_ = true;
  }

  /// Updates the grid and slice, then pauses for as long as that took, to leave the core to other
  /// threads.
  void updateOutputs(SteadyTime now) {
    is_outdated_ = publish_now_ = false;
    if (grid_) {
      const GroundGrid::Pending pending = grid_->next();
      if (grid_->tooLarge()) warnTooLarge(*grid_->tooLarge());
      if (pending == GroundGrid::Pending::kGrid) is_grid_due_ = true;
      if (pending == GroundGrid::Pending::kUpdate) is_update_due_ = true;
    }
    if (slices_.hasSubscribers()) publishSlice();
    pace_.end(now);
  }

  static void warnTooLarge(const GridBox& window) {
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "occupancy_grid would have "
                                       << sizeOf(window).x() << " x " << sizeOf(window).y()
                                       << " cells, more than " << GroundGrid::kMaxColumns
                                       << ", so it no longer grows; use larger cells "
                                          "(space/cell_voxels) or map/keep_radius_m, and check for "
                                          "frames with wrong poses");
  }

  void publishGrid(SteadyTime now) {
    const GridBox& window = *grid_->window();
    nav_msgs::OccupancyGrid grid;
    grid.header = headerOf(known().stamp);
    grid.info.map_load_time = grid.header.stamp;
    grid.info.resolution = static_cast<float>(grid_->cellSize_m());
    grid.info.width = static_cast<uint32_t>(sizeOf(window).x());
    grid.info.height = static_cast<uint32_t>(sizeOf(window).y());
    grid.info.origin.position.x = window.min().x() * grid_->cellSize_m();
    grid.info.origin.position.y = window.min().y() * grid_->cellSize_m();
    grid.info.origin.orientation.w = 1.0;
    grid.data = grid_->values(window);
    grids_.publish(grid);
    grid_at_ = now;
    is_update_due_ = true;
  }

  void publishUpdate(SteadyTime now) {
    is_update_due_ = false;
    const GridBox& box = now - grid_at_ < kSettling ? *grid_->window() : grid_->changed();
    if (box.isEmpty() || !updates_.hasSubscribers()) return;
    map_msgs::OccupancyGridUpdate update;
    update.header = headerOf(known().stamp);
    update.x = box.min().x() - grid_->window()->min().x();
    update.y = box.min().y() - grid_->window()->min().y();
    update.width = static_cast<uint32_t>(sizeOf(box).x());
    update.height = static_cast<uint32_t>(sizeOf(box).y());
    update.data = grid_->values(box);
    updates_.publish(update);
  }

  void publishSlice() {
    const auto [space, stamp] = known();
    std::vector<Eigen::Vector4f> points;
    if (!space->isEmpty()) points = sliceAt(*space, host_.params.slice_height_m);
    sensor_msgs::PointCloud2 cloud;
    cloud.header = headerOf(stamp);
    cloud.height = 1;
    cloud.is_dense = true;
    sensor_msgs::PointCloud2Modifier modifier(cloud);
    constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
    modifier.setPointCloud2Fields(4, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "intensity", 1,
                                  kFloat);
    modifier.resize(points.size());
    sensor_msgs::PointCloud2Iterator<float> next(cloud, "x");
    for (const Eigen::Vector4f& point : points) {
      std::copy_n(point.data(), 4, &next[0]);
      ++next;
    }
    slices_.publish(cloud);
  }

  // costmap_2d's StaticLayer receives grids and updates on separate connections, and applies each
  // update to its last grid without checking bounds. If several messages arrive in one of its
  // cycles, only the region of the last message takes effect. So updates begin some time after a
  // grid, and cover the whole grid for several cycles.
  static constexpr std::chrono::milliseconds kUpdateGap{200}, kSettling{2000};

  std_msgs::Header headerOf(const ros::Time& stamp) const {
    std_msgs::Header header;
    header.frame_id = frameOfMap(host_.params);
    header.stamp = stamp;
    return header;
  }

  const Host& host_;
  const bool is_on_;

  bool is_part_ = false;  ///< Whether the map has more changes to queue (map thread only).

  // Used on the output thread only, except for the topics and the servers.
  std::unique_ptr<SpaceFollower> follower_;
  std::optional<GroundGrid> grid_;  ///< Set while somebody listens.
  bool is_grid_due_ = false, is_outdated_ = false;
  bool publish_now_ = false;  ///< Do not wait for pace_, because the map or a listener is new.
  SteadyTime grid_at_{};
  bool is_update_due_ = false;  ///< Listeners need an update.
  Pace pace_;
  Topic grids_, updates_, slices_;
  ros::ServiceServer server_, grid_server_;

  mutable std::mutex mutex_;             ///< Guards the members below.
  std::optional<SpaceChanges> waiting_;  ///< The queue to the output thread.
  double waiting_cell_m_ = 0.0;          ///< Size of the cells in `waiting_`.
  ros::Time waiting_stamp_;              ///< Stamp of the mesh that `waiting_` belongs to.
  Known known_;
  size_t bytes_ = 0;
  PagedValues::Stats pages_;
};

}  // namespace dtsdf
