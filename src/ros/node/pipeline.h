/// The way of an image through the node, from its topic to mesh, files, grid and distances: the
/// parts, and the loops that they run in.
#pragma once

#include <dtsdf_mapping/MapStatus.h>
#include <ros/node_handle.h>

#include <atomic>
#include <vector>

#include "params/node_params.h"
#include "ros/common/worker_thread.h"
#include "ros/input/cameras.h"
#include "ros/input/frame_queue.h"
#include "ros/input/input_status.h"
#include "ros/input/transforms.h"
#include "ros/node/output.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Its threads: dtsdf_input (messages, poses), dtsdf_map (fuse, mesh), dtsdf_output (what is
/// published) and two of dtsdf_service. What waits for a loop throws what the loop's work throws,
/// and std::future_error once the loops have stopped.
class Pipeline {
 public:
  /// Loads map/load_file, and then receives images.
  /// @throws ParamError or std::runtime_error if the node cannot start.
  Pipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~Pipeline();

  const MappingParams& params() const { return params_; }

  void setRates(const PublishParams& rates) { rates_.set(rates); }

  /// The status but for what is not the pipeline's. One thread at a time.
  void fill(dtsdf_mapping::MapStatus& status);

 private:
  void advertise(const Handles& handles);
  void start(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  void stop();
  void settle();

  const MappingParams params_;
  Rates rates_;
  std::atomic<bool> is_ending_{false};
  WorkerThread output_loop_, map_loop_;
  CallbackThread services_, input_;
  Transforms transforms_;
  MapFrame frame_;
  FrameQueue queue_;
  Steps steps_;  ///< Empty until start().
  Output output_;
  LiveMap map_;
  const Host host_;
  Cameras cameras_;
  InputStatus input_status_;
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace dtsdf
