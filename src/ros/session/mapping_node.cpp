#include "ros/session/mapping_node.h"

#include <ros/console.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include <chrono>
#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {
namespace {

constexpr std::chrono::milliseconds kAskPeriod{3000};

}  // namespace

MasterWatch::MasterWatch(std::string service)
    : service_(std::move(service)), thread_([this] {
        look();
        return kAskPeriod;
      }) {}

std::string MasterWatch::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void MasterWatch::look() {
  std::string problem;
  guarded("watching the master", [&] { problem = ask(); });
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!problem.empty() && problem_.empty()) ROS_ERROR_STREAM_NAMED("dtsdf_mapping", problem);
  if (problem.empty() && !problem_.empty()) {
    ROS_INFO_NAMED("dtsdf_mapping", "this node is registered with the ROS master again");
  }
  problem_ = problem;
}

std::string MasterWatch::ask() const {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = service_;
  if (ros::master::execute("lookupService", request, response, payload, false)) return "";
  const std::string& uri = ros::master::getURI();
  if (!ros::master::check()) {
    return "the ROS master at " + uri +
           " does not answer: existing connections keep working, but "
           "nobody can find this node; restart the master, then this "
           "node";
  }
  return "the ROS master at " + uri +
         " no longer knows this node, so it has been restarted: "
         "existing connections keep working, but no service call and "
         "no new listener can find this node; restart this node and "
         "all others (the map starts empty)";
}

MappingNode::MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
    : pipeline_(nh, private_nh),
      services_(private_nh, pipeline_),
      master_watch_(services_.nameOfOne()),
      status_(nh, private_nh,
              StatusPublisher::Options{frameOfMap(pipeline_.params().node),
                                       pipeline_.params().node.publish.status_rate_hz},
              [this] {
                StatusInput input = pipeline_.status();
                input.master = master_watch_.problem();
                return input;
              }),
      rates_(ros::NodeHandle(private_nh, "publish")) {
  rates_.setCallback([this](const dtsdf_mapping::PublishConfig& config, uint32_t) {
    guarded("rates", [&] { setRates(config); });
  });
  services_.start();  // last, so that nobody waits for a loop that a failing constructor has ended
}

void MappingNode::setRates(const dtsdf_mapping::PublishConfig& config) {
  PublishParams rates = pipeline_.params().node.publish;
  rates.mesh_rate_hz = config.mesh_rate_hz;
  rates.points_rate_hz = config.points_rate_hz;
  rates.status_rate_hz = config.status_rate_hz;
  rates.space_rate_hz = config.space_rate_hz;
  status_.setRate(rates.status_rate_hz);
  pipeline_.setRates(rates);
}

}  // namespace dtsdf
