/// A live map with all its dependencies, for tests without a ROS master.
#pragma once

#include <boost/make_shared.hpp>
#include <memory>
#include <utility>

#include "ros/input/frame_queue.h"
#include "ros/steps/live_map.h"
#include "ros/support/fake_clock.h"
#include "ros/support/transforms.h"
#include "support/fake_mapper.h"

namespace dtsdf {

/// Puts a frame into the queue as if its pose had just been looked up.
inline void pushPosed(FrameQueue& queue, FrameQueue::Stream stream, PosedFrame frame) {
  const auto image = makeDepthImage(0.0);
  const auto info = makeCameraInfo(0.0);
  image->header.stamp = info->header.stamp = frame.stamp;
  queue.add(stream, {image});
  queue.add(stream, {nullptr, info});
  queue.poseFirst(stream, [&](auto&&...) { return std::move(frame); });
}

struct MapHost {
  /// Stream 0 is depth, stream 1 is colour.
  explicit MapHost(std::unique_ptr<Mapper> mapper, NodeParams settings = {})
      : params(std::move(settings)),
        map(std::move(mapper), params, queue, frame, mesh_changes, steps, clock.reader()) {
    ros::Time::init();  // needed to throttle warnings
    queue.addStream(false, "", std::nullopt, depth);
    queue.addStream(true, "", std::nullopt, colour);
  }

  void push(FrameQueue::Stream stream, PosedFrame posed) {
    (stream == 0 ? depth : colour).imageReceived(posed.stamp);
    pushPosed(queue, stream, std::move(posed));
  }

  /// Calls step() until nothing is left to do.
  void work() {
    while (map.step() == std::chrono::milliseconds(0)) {
    }
  }

  dtsdf_mapping::MapStatus status() const {
    dtsdf_mapping::MapStatus status;
    map.fill(status);
    return status;
  }

  FakeClock clock;
  NodeParams params;
  Transforms transforms{clock.reader()};
  MapFrame frame{params, transforms};
  FrameAccounting depth, colour;
  FrameQueue queue{30, size_t{256} << 20, 0.1, [] {}, clock.reader()};
  MeshQueue mesh_changes{[] {}};
  Steps steps;
  LiveMap map;
  ShownMesh mesh{params.mapper.map};
  WorkerThread map_loop{"test"};
  std::atomic<bool> is_ending{false};
  const Host host{params, transforms, frame, map, mesh, map_loop, [] {}, [] {}, is_ending};
};

}  // namespace dtsdf
