/// How services answer: what was done or why it was not, in words that may stand in a log.
#pragma once

#include <ros/console.h>

#include <exception>

#include "params/printable.h"

namespace dtsdf {

/// Has `work` fill the answer, but for success and with a message of what was done; where it throws
/// the answer says why, and nothing else. Either goes to the log, failures every five seconds at
/// most.
template <class Response, class Work>
void answer(const char* service, Response& response, const Work& work) {
  try {
    work();
    response.success = true;
    response.message = printableMessage(response.message);
    if (response.message.empty()) return;
    ROS_INFO_STREAM_NAMED("dtsdf_mapping", service << ": " << response.message);
  } catch (const std::exception& error) {
    response = Response();
    response.success = false;
    response.message = errorText(error);
    ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", service << ": " << response.message);
  }
}

}  // namespace dtsdf
