#include "ros/common/node_help.h"

#include <algorithm>
#include <cstdio>

namespace dtsdf {

bool printHelp(int argc, const char* const* argv, const std::string& usage,
               const ParamTree& defaults) {
  const bool is_asked = std::any_of(argv, argv + argc, [](const std::string& argument) {
    return argument == "--help" || argument == "-h";
  });
  if (!is_asked) return false;
  std::printf("%s\nSettings, with their defaults:\n", usage.c_str());
  for (const auto& [key, value] : defaults) {
    std::printf("  _%s:=%s\n", key.c_str(), toString(value).c_str());
  }
  return true;
}

}  // namespace dtsdf
