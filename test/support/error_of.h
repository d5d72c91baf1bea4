#pragma once

#include <exception>
#include <string>

namespace dtsdf {

/// Returns the text of the `Error` thrown by `action`, or "" if nothing is thrown.
template <class Error = std::exception, class Action>
std::string errorOf(const Action& action) {
  try {
    action();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

}  // namespace dtsdf
