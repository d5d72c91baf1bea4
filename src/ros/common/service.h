/// The one way in which services answer: what was done or why it was not, in words that may stand
/// in a log, whatever the names from outside in them.
#pragma once

#include <ros/console.h>
#include <ros/node_handle.h>

#include <exception>
#include <functional>
#include <string>
#include <utility>

#include "params/printable.h"

namespace dtsdf {

/// What a service does: fills the answer, or throws.
template <class Service>
using ServiceWork =
    std::function<void(const typename Service::Request&, typename Service::Response&)>;

/// Advertises a service. `work` fills the answer, but for success and with a message of what was
/// done; where it throws the answer says why, and nothing else. Either goes to the log, failures
/// every five seconds at most.
template <class Service>
ros::ServiceServer serve(ros::NodeHandle nh, const std::string& name, ServiceWork<Service> work) {
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  const boost::function<bool(Request&, Response&)> callback =
      [name, work = std::move(work)](Request& request, Response& response) {
        std::string problem = "unknown error";
        try {
          work(request, response);
          response.success = true;
          response.message = printableMessage(response.message);
          if (response.message.empty()) return true;
          ROS_INFO_STREAM_NAMED("dtsdf_mapping", name << ": " << response.message);
          return true;
        } catch (const std::exception& error) {
          problem = errorText(error);
        } catch (...) {  // what leaves a callback ends every nodelet of the process
        }
        response = Response();
        response.message = problem;
        ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", name << ": " << problem);
        return true;
      };
  return nh.advertiseService<Request, Response>(name, callback);
}

}  // namespace dtsdf
