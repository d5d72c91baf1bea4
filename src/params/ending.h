/// Endings of names: of files, topics and settings.
#pragma once

#include <string_view>

namespace dtsdf {

/// Also true of a name that is nothing but its ending.
inline bool endsWith(std::string_view name, std::string_view ending) {
  return name.size() >= ending.size() &&
         name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

/// What has something before its ending.
inline bool hasEnding(std::string_view name, std::string_view ending) {
  return name.size() > ending.size() && endsWith(name, ending);
}

}  // namespace dtsdf
