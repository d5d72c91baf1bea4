/// The mapping node: the pipeline with its services, status and rates.
#pragma once

#include <ros/node_handle.h>

#include "ros/output/status_publisher.h"
#include "ros/session/map_services.h"
#include "ros/session/mapping_pipeline.h"
#include "ros/session/master_watch.h"
#include "ros/session/rate_server.h"

namespace dtsdf {

/// The same for the nodelet and the node. The thread(s) of the caller's node handles take images,
/// publish the status and pause.
class MappingNode {
 public:
  /// @throws ParamError or std::runtime_error if the node cannot start.
  MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);

 private:
  StatusInput collectStatus() const;
  void setRates(const PublishParams& rates);

  // They end from the outside in: nothing calls into a part that is gone.
  MappingPipeline pipeline_;
  MapServices services_;
  MasterWatch master_watch_;
  StatusPublisher status_;
  RateServer rates_;
};

}  // namespace dtsdf
