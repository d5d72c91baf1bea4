#include "ros/common/node_start.h"

#include <ros/console.h>
#include <ros/exceptions.h>
#include <ros/init.h>
#include <ros/param.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "params/printable.h"

namespace dtsdf {
namespace {

/// Prints help if it is asked for; false if it is not.
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

/// Starts ROS. False, with a sentence on stderr, for arguments that it cannot read.
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

/// What a node adds to the error of its settings: those it does not know which are on the parameter
/// server, though not among its arguments. ROS keeps there what an earlier run was given. The
/// arguments are those of before initNode(), which takes settings out of them.
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

/// Read by image_transport and its plugins, diagnostic_updater and a standalone nodelet manager.
bool belongsToRos(const std::string& key) {
  for (const char* name :
       {"image_transport", "color_image_transport", "diagnostic_period", "num_worker_threads"}) {
    if (key == name) return true;
  }
  for (const char* section : {"compressed/", "compressedDepth/", "theora/"}) {
    if (key.rfind(section, 0) == 0) return true;
  }
  return false;
}

/// A list, if all it holds are names.
std::optional<ParamValue> namesOf(XmlRpc::XmlRpcValue& list) {
  std::vector<std::string> names;
  for (int i = 0; i < list.size(); ++i) {
    if (list[i].getType() != XmlRpc::XmlRpcValue::TypeString) return std::nullopt;
    names.push_back(static_cast<std::string>(list[i]));
  }
  return names;
}

void flatten(const std::string& key, XmlRpc::XmlRpcValue& value, ServerParams& params) {
  using XmlRpc::XmlRpcValue;
  switch (value.getType()) {
    case XmlRpcValue::TypeStruct:
      for (auto& [name, child] : value) {
        flatten(key.empty() ? name : key + "/" + name, child, params);
      }
      return;
    case XmlRpcValue::TypeBoolean: params.tree[key] = static_cast<bool>(value); break;
    case XmlRpcValue::TypeInt: params.tree[key] = static_cast<int>(value); break;
    case XmlRpcValue::TypeDouble: params.tree[key] = static_cast<double>(value); break;
    case XmlRpcValue::TypeString: params.tree[key] = static_cast<std::string>(value); break;
    case XmlRpcValue::TypeArray:
      if (const auto names = namesOf(value)) {
        params.tree[key] = *names;
        break;
      }
      [[fallthrough]];
    default:
      if (!belongsToRos(key)) {
        params.violations.emplace_back(key, "must be a single value or a list of names");
      }
  }
  if (belongsToRos(key)) params.tree.erase(key);
}

}  // namespace

ServerParams readParamServer(const ros::NodeHandle& private_nh) {
  ServerParams params;
  XmlRpc::XmlRpcValue value;
  if (!ros::param::get(private_nh.getNamespace(), value)) return params;  // nothing is set
  flatten("", value, params);
  return params;
}

int runNode(int argc, char** argv, const std::string& node_name, const std::string& usage,
            const ParamTree& defaults,
            const std::function<void(const ros::NodeHandle&, const ros::NodeHandle&)>& run) {
  if (printHelp(argc, argv, usage, defaults)) return 0;
  const std::vector<std::string> arguments(argv, argv + argc);
  if (!initNode(argc, argv, node_name, defaults)) return 2;
  // ROS, and with it the log, ends with the last handle.
  const ros::NodeHandle nh, private_nh("~");
  const std::string& name = private_nh.getNamespace();
  std::string problem;
  try {
    run(nh, private_nh);
    return 0;
  } catch (const ParamError& error) {
    problem = startErrorText(error) +
              leftoversText(arguments, name, readParamServer(private_nh).tree, defaults);
  } catch (const std::exception& error) {
    problem = startErrorText(error);
  }
  ROS_FATAL_STREAM(name << " cannot start: " << problem);
  return 1;
}

}  // namespace dtsdf
