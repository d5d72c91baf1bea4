/// The mapping node, as nodelet and as node: the way of an image from its topic to mesh, files,
/// grid and distances, the loops that its parts run in, the services and the status.
#pragma once

#include <ros/node_handle.h>

#include <memory>

namespace dtsdf {

/// Ends with the last copy of what is returned.
/// @throws ParamError or std::runtime_error if the node cannot start.
std::shared_ptr<void> startPipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);

}  // namespace dtsdf
