/// Entry point of the standalone node.
#include <ros/ros.h>

#include "params/node_params.h"
#include "ros/common/node_start.h"
#include "ros/node/pipeline.h"

namespace {

constexpr char kUsage[] =
    "usage: rosrun dtsdf_mapping mapping_node [_SETTING:=VALUE...] [TOPIC:=OTHER_TOPIC...]\n\n"
    "Maps depth images with a directional TSDF. Needs a ROS master. Most users run\n"
    "roslaunch dtsdf_mapping mapping.launch, which reads config/default.yaml. docs/ros.md lists\n"
    "topics, services and settings.\n";

}  // namespace

int main(int argc, char** argv) {
  return dtsdf::runNode(argc, argv, "mapping", kUsage, dtsdf::toTree(dtsdf::NodeParams()),
                        [](const ros::NodeHandle& nh, const ros::NodeHandle& private_nh) {
                          const auto node = dtsdf::startPipeline(nh, private_nh);
                          ros::spin();
                        });
}
