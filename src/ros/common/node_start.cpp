#include "ros/common/node_start.h"

#include <ros/console.h>
#include <ros/exceptions.h>
#include <ros/init.h>
#include <ros/param.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <cstdio>
#include <string>
#include <vector>

#include "params/printable.h"

namespace dtsdf {
namespace {

/// Whether the key is read by image_transport, its plugins, diagnostic_updater or a standalone
/// nodelet manager.
bool belongsToRos(const std::string& key) {
  const std::string name = key.substr(0, key.find('/'));
  for (const char* of_ros :
       {"image_transport", "color_image_transport", "diagnostic_period", "num_worker_threads",
        "compressed", "compressedDepth", "theora", "rendered"}) {
    if (name == of_ros) return true;
  }
  return false;
}

void flatten(const std::string& key, XmlRpc::XmlRpcValue& value, ParamTree& tree,
             std::vector<ParamViolation>& violations) {
  using XmlRpc::XmlRpcValue;
  if (belongsToRos(key)) return;
  std::vector<std::string> names;
  switch (value.getType()) {
    case XmlRpcValue::TypeStruct:
      for (auto& [name, child] : value) {
        flatten(key.empty() ? name : key + "/" + name, child, tree, violations);
      }
      return;
    case XmlRpcValue::TypeBoolean: tree[key] = static_cast<bool>(value); return;
    case XmlRpcValue::TypeInt: tree[key] = static_cast<int>(value); return;
    case XmlRpcValue::TypeDouble: tree[key] = static_cast<double>(value); return;
    case XmlRpcValue::TypeString: tree[key] = static_cast<std::string>(value); return;
    case XmlRpcValue::TypeArray:
      for (int i = 0; i < value.size() && value[i].getType() == XmlRpcValue::TypeString; ++i) {
        names.push_back(static_cast<std::string>(value[i]));
      }
      if (static_cast<int>(names.size()) < value.size()) break;
      tree[key] = names;
      return;
    default: break;
  }
  violations.emplace_back(key, "must be a single value or a list of names");
}

}  // namespace

ParamTree readParamServer(const ros::NodeHandle& private_nh,
                          std::vector<ParamViolation>& violations) {
  ParamTree tree;
  XmlRpc::XmlRpcValue value;
  if (ros::param::get(private_nh.getNamespace(), value)) flatten("", value, tree, violations);
  return tree;
}

int runNode(int argc, char** argv, const std::string& node_name, const std::string& usage,
            const ParamTree& defaults,
            const std::function<void(const ros::NodeHandle&, const ros::NodeHandle&)>& run) {
  for (const std::string& argument : std::vector<std::string>(argv, argv + argc)) {
    if (argument == "--help" || argument == "-h") {
      std::printf("%s\nSettings, with their defaults:\n", usage.c_str());
      for (const auto& [key, value] : defaults) {
        std::printf("  _%s:=%s\n", key.c_str(), toString(value).c_str());
      }
      return 0;
    }
    const size_t sign = argument.find(":=");
    if (sign == std::string::npos || defaults.count(argument.substr(0, sign)) == 0) continue;
    std::fprintf(
        stderr,
        "%s: error: ROS would take '%s' for a topic remapping; settings begin with _: _%s\n",
        node_name.c_str(), printable(argument).c_str(), printable(argument).c_str());
    return 2;
  }
  try {
    ros::init(argc, argv, node_name);
  } catch (const ros::Exception& error) {
    std::fprintf(stderr, "%s: error: %s; arguments must be TOPIC:=OTHER_TOPIC or _SETTING:=VALUE\n",
                 node_name.c_str(), errorText(error).c_str());
    return 2;
  }
  // ROS, including its log, shuts down with the last handle.
  const ros::NodeHandle nh, private_nh("~");
  try {
    run(nh, private_nh);
    return 0;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(private_nh.getNamespace() << " cannot start: " << startErrorText(error));
    return 1;
  }
}

}  // namespace dtsdf
