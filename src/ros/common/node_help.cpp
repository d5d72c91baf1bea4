#include "ros/common/node_help.h"

#include <ros/exceptions.h>
#include <ros/init.h>

#include <algorithm>
#include <cstdio>

#include "params/printable.h"

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

bool initNode(int& argc, char** argv, const std::string& name, const ParamTree& settings) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t sign = argument.find(":=");
    if (sign == std::string::npos || settings.count(argument.substr(0, sign)) == 0) continue;
    std::fprintf(stderr,
                 "%s: error: '%s' is read as a topic remapping; settings begin with _: _%s\n",
                 name.c_str(), printable(argument).c_str(), printable(argument).c_str());
    return false;
  }
  try {
    ros::init(argc, argv, name);
    return true;
  } catch (const ros::Exception& error) {
    std::fprintf(stderr, "%s: error: %s; arguments are TOPIC:=OTHER_TOPIC or _SETTING:=VALUE\n",
                 name.c_str(), errorText(error).c_str());
    return false;
  }
}

std::string leftoversText(const std::vector<std::string>& arguments, const std::string& ns,
                          const ParamTree& on_server, const ParamTree& settings) {
  std::string text;
  for (const auto& [key, value] : on_server) {
    const std::string argument = "_" + key + ":=";
    const bool is_argument =
        std::any_of(arguments.begin(), arguments.end(),
                    [&](const std::string& given) { return given.rfind(argument, 0) == 0; });
    if (settings.count(key) > 0 || is_argument) continue;
    text += "\n  " + printable(key) + ": left by an earlier run? rosparam delete " + ns + "/" +
            printable(key);
  }
  return text;
}

}  // namespace dtsdf
