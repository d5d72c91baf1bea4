/// The mapping node, as nodelet and as node: the way of an image from its topic to mesh, files,
/// grid and distances, the loops that its parts run in, the services and the status.
#pragma once

#include <dtsdf_mapping/MapStatus.h>
#include <dtsdf_mapping/PublishConfig.h>
#include <dynamic_reconfigure/server.h>
#include <ros/node_handle.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "params/node_params.h"
#include "ros/common/worker_thread.h"
#include "ros/input/frame_queue.h"
#include "ros/input/image_stream.h"
#include "ros/input/input_status.h"
#include "ros/input/transforms.h"
#include "ros/node/output.h"
#include "ros/node/status.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Its threads: dtsdf_input (messages, poses), dtsdf_map (fuse, mesh), dtsdf_output (what is
/// published) and two of dtsdf_service. What waits for a loop throws what the loop's work throws,
/// and std::future_error once the loops have stopped. The thread(s) of the caller's node handles
/// publish the status, pause and answer queries.
class Pipeline {
 public:
  /// Loads map/load_file, and then receives images.
  /// @throws ParamError or std::runtime_error if the node cannot start.
  Pipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~Pipeline();

 private:
  void advertise(const Handles& handles);
  void start(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  void addStreams(const ros::NodeHandle& nh, const std::string& ns);
  std::chrono::milliseconds poseFrames() noexcept;
  void restartStamps(const ros::Time& stamp);
  void stop();
  void settle();
  void setRates(const dtsdf_mapping::PublishConfig& rates);
  void fill(dtsdf_mapping::MapStatus& status);

  const MappingParams params_;
  Rates rates_;
  std::atomic<bool> is_ending_{false};
  WorkerThread output_loop_, map_loop_, services_, input_;
  Transforms transforms_;
  MapFrame frame_;
  FrameQueue queue_;
  Steps steps_;  ///< Empty until start().
  Output output_;
  LiveMap map_;
  const Host host_;
  /// Of each camera its depth, and its colour where that is wanted.
  std::vector<std::unique_ptr<ImageStream>> streams_;
  InputStatus input_status_;
  std::vector<ros::ServiceServer> servers_;
  std::optional<StatusPublisher> status_;
  /// Below `publish/`, so that its keys are those of the settings.
  std::optional<dynamic_reconfigure::Server<dtsdf_mapping::PublishConfig>> rates_server_;
};

}  // namespace dtsdf
