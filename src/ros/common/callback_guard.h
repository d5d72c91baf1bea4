/// Catches exceptions in ROS callbacks: an exception that escapes terminates every nodelet in the
/// process.
#pragma once

#include <ros/console.h>

#include <exception>

#include "params/printable.h"

namespace dtsdf {

/// Runs `body`. If it throws, logs the exception with the callback's name.
template <class Body>
void guarded(const char* callback, Body&& body) noexcept {
  try {
    body();
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM_NAMED("dtsdf_mapping", callback << ": " << errorText(error));
  } catch (...) {
    ROS_ERROR_STREAM_NAMED("dtsdf_mapping", callback << ": unknown error");
  }
}

}  // namespace dtsdf
