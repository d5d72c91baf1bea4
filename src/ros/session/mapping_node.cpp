#include "ros/session/mapping_node.h"

#include <dtsdf_mapping/PublishConfig.h>
#include <dynamic_reconfigure/server.h>
#include <ros/console.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include <chrono>
#include <mutex>
#include <string>
#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/common/worker_thread.h"
#include "ros/output/status_publisher.h"
#include "ros/session/map_services.h"
#include "ros/session/mapping_pipeline.h"

namespace dtsdf {
namespace {

constexpr std::chrono::milliseconds kAskPeriod{3000};

/// Whether the ROS master still knows this node. A master that was restarted has forgotten all
/// nodes, and roscpp does not register again: who is connected stays so, but nobody else finds the
/// node, neither its topics nor its services. Asks every few seconds, on a thread of its own, as a
/// master that hangs may answer late.
class MasterWatch {
 public:
  /// `service` is one of the node's own, which the master has to know.
  explicit MasterWatch(std::string service)
      : service_(std::move(service)), thread_([this] {
          look();
          return kAskPeriod;
        }) {}

  /// What is wrong, and what to do; empty if nothing is.
  std::string problem() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return problem_;
  }

 private:
  void look();
  std::string ask() const;

  const std::string service_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::string problem_;
  WorkerThread thread_;
};

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

class MappingNode {
 public:
  MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
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
    // Last, so that nobody waits for a loop that a failing constructor has ended.
    services_.start();
  }

 private:
  void setRates(const dtsdf_mapping::PublishConfig& config) {
    PublishParams rates = pipeline_.params().node.publish;
    rates.mesh_rate_hz = config.mesh_rate_hz;
    rates.points_rate_hz = config.points_rate_hz;
    rates.status_rate_hz = config.status_rate_hz;
    rates.space_rate_hz = config.space_rate_hz;
    status_.setRate(rates.status_rate_hz);
    pipeline_.setRates(rates);
  }

  // They end from the outside in: nothing calls into a part that is gone.
  MappingPipeline pipeline_;
  MapServices services_;
  MasterWatch master_watch_;
  StatusPublisher status_;
  /// Below `publish/`, so that its keys are those of the settings.
  dynamic_reconfigure::Server<dtsdf_mapping::PublishConfig> rates_;
};

}  // namespace

std::shared_ptr<void> startMapping(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh) {
  return std::make_shared<MappingNode>(nh, private_nh);
}

}  // namespace dtsdf
