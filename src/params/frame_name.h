/// Names of coordinate frames, as settings and messages spell them.
#pragma once

#include <string>

namespace dtsdf {

/// A frame's name without the leading slash of old tf, which tf2 does not know.
inline std::string stripLeadingSlash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

}  // namespace dtsdf
