/// What a program or nodelet that cannot start says.
#pragma once

#include <exception>
#include <string>

#include "dtsdf_mapping/params/param_set.h"
#include "params/printable.h"

namespace dtsdf {

/// Wrong settings in a line each, whose names and values are printable; else one sentence.
inline std::string startErrorText(const std::exception& error) {
  const bool is_list = dynamic_cast<const ParamError*>(&error) != nullptr;
  return is_list ? error.what() : errorText(error);
}

}  // namespace dtsdf
