/// The mapping node: the pipeline with its services, status and rates.
#pragma once

#include <ros/node_handle.h>

#include <memory>

namespace dtsdf {

/// Starts it, for the nodelet and for the node. The thread(s) of the caller's node handles take
/// images, publish the status and pause.
/// @return what ends it. @throws ParamError or std::runtime_error if the node cannot start.
std::shared_ptr<void> startMapping(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);

}  // namespace dtsdf
