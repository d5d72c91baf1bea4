/// The mapping node, run as a nodelet or standalone: topics, services, threads and status.
#pragma once

#include <ros/node_handle.h>

#include <memory>

namespace dtsdf {

/// Starts the node, which runs until the last copy of the returned pointer is gone.
/// @throws ParamError or std::runtime_error if the node cannot start.
std::shared_ptr<void> startPipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);

}  // namespace dtsdf
