#pragma once

#include <exception>
#include <string>

namespace dtsdf {

/// The text of the `Error` that `action` throws; "" if it throws nothing.
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
