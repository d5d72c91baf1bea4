#include "ros/session/master_watch.h"

#include <ros/console.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include <chrono>
#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {

MasterWatch::MasterWatch(std::string service, double period_s)
    : service_(std::move(service)), period_s_(period_s), thread_([this] { run(); }) {}

MasterWatch::~MasterWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  thread_.join();
}

std::string MasterWatch::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void MasterWatch::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto period = std::chrono::duration<double>(period_s_);
  while (!stop_.wait_for(lock, period, [this] { return stopping_; })) {
    lock.unlock();
    std::string problem;
    guarded("watching the master", [&] { problem = ask(); });
    lock.lock();
    if (!problem.empty() && problem_.empty()) ROS_ERROR_STREAM_NAMED("dtsdf_mapping", problem);
    if (problem.empty() && !problem_.empty()) {
      ROS_INFO_NAMED("dtsdf_mapping", "this node is registered with the ROS master again");
    }
    problem_ = problem;
  }
}

std::string MasterWatch::ask() const {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = service_;
  if (ros::master::execute("lookupService", request, response, payload, false)) return "";
  const std::string& uri = ros::master::getURI();
  if (!ros::master::check()) {
    return "the ROS master at " + uri + " does not answer: existing connections keep working, but "
                                        "nobody can find this node; restart the master, then this "
                                        "node";
  }
  return "the ROS master at " + uri + " no longer knows this node, so it has been restarted: "
                                      "existing connections keep working, but no service call and "
                                      "no new listener can find this node; restart this node and "
                                      "all others (the map starts empty)";
}

}  // namespace dtsdf
