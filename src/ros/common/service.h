/// Code shared by all services, whose responses say in printable text what was done or why the call
/// failed.
#pragma once

#include <ros/console.h>
#include <ros/node_handle.h>

#include <exception>
#include <string>
#include <utility>

#include "params/printable.h"

namespace dtsdf {

/// Advertises a service. `work` gets request and response, and fills the response except `success`;
/// its `message` says what was done. If `work` throws, the response holds only the error text.
/// Error texts, and messages that are not empty, are logged; errors at most every five seconds.
template <class Service, class Work>
ros::ServiceServer serve(ros::NodeHandle nh, const std::string& name, Work work) {
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
        } catch (...) {  // escaping would terminate every nodelet
        }
        response = Response();
        response.message = problem;
        ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", name << ": " << problem);
        return true;
      };
  return nh.advertiseService<Request, Response>(name, callback);
}

}  // namespace dtsdf
