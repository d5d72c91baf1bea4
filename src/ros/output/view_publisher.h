/// Publishes what the camera would see of the map, as a depth camera does, while someone listens.
#pragma once

#include <ros/node_handle.h>
#include <std_msgs/Header.h>

#include "dtsdf_mapping/rendered_view.h"
#include "ros/common/schedule.h"

namespace dtsdf {

/// Map's thread only.
class ViewPublisher {
 public:
  /// Topics of `private_nh`.
  ViewPublisher(ros::NodeHandle private_nh, SteadyClock clock);

  /// Whether someone listens, and the next view may be rendered.
  bool isDue() const;

  /// A view whose rendering was begun at `begin`.
  void publish(const std_msgs::Header& header, const RenderCamera& camera, const RenderedView& view,
               SteadyTime begin);

 private:
  SteadyClock clock_;
  Pace pace_;
  ros::Publisher images_, infos_;
};

}  // namespace dtsdf
