/// The mapping node: the pipeline with its services, status and rates.
#pragma once

#include <dtsdf_mapping/PublishConfig.h>
#include <dynamic_reconfigure/server.h>
#include <ros/node_handle.h>

#include <mutex>
#include <string>

#include "ros/common/worker_thread.h"
#include "ros/output/status_publisher.h"
#include "ros/session/map_services.h"
#include "ros/session/mapping_pipeline.h"

namespace dtsdf {

/// Whether the ROS master still knows this node. A master that was restarted has forgotten all
/// nodes, and roscpp does not register again: who is connected stays so, but nobody else finds the
/// node, neither its topics nor its services. Asks every few seconds, on a thread of its own, as a
/// master that hangs may answer late.
class MasterWatch {
 public:
  /// `service` is one of the node's own, which the master has to know.
  explicit MasterWatch(std::string service);

  /// What is wrong, and what to do; empty if nothing is.
  std::string problem() const;

 private:
  void look();
  std::string ask() const;

  const std::string service_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::string problem_;
  WorkerThread thread_;
};

/// The same for the nodelet and the node. The thread(s) of the caller's node handles take images,
/// publish the status and pause.
class MappingNode {
 public:
  /// @throws ParamError or std::runtime_error if the node cannot start.
  MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);

 private:
  void setRates(const dtsdf_mapping::PublishConfig& config);

  // They end from the outside in: nothing calls into a part that is gone.
  MappingPipeline pipeline_;
  MapServices services_;
  MasterWatch master_watch_;
  StatusPublisher status_;
  /// Below `publish/`, so that its keys are those of the settings.
  dynamic_reconfigure::Server<dtsdf_mapping::PublishConfig> rates_;
};

}  // namespace dtsdf
