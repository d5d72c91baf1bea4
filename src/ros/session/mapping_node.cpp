#include "ros/session/mapping_node.h"

namespace dtsdf {

MappingNode::MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
    : pipeline_(nh, private_nh),
      services_(private_nh, pipeline_),
      master_watch_(services_.nameOfOne()),
      status_(nh, private_nh,
              StatusPublisher::Options{frameOfMap(pipeline_.params().node),
                                       pipeline_.params().node.publish.status_rate_hz},
              [this] { return collectStatus(); }),
      rates_(private_nh, pipeline_.params().node.publish,
             [this](const PublishParams& rates) { setRates(rates); }) {
  services_.start();  // last, so that nobody waits for a loop that a failing constructor has ended
}

StatusInput MappingNode::collectStatus() const {
  StatusInput input = pipeline_.status();
  input.master = master_watch_.problem();
  return input;
}

void MappingNode::setRates(const PublishParams& rates) {
  status_.setRate(rates.status_rate_hz);
  pipeline_.setRates(rates);
}

}  // namespace dtsdf
