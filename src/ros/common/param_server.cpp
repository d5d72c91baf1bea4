#include "ros/common/param_server.h"

#include <ros/param.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace dtsdf {
namespace {

/// Read by image_transport and its plugins, diagnostic_updater and a standalone nodelet manager.
bool belongsToRos(const std::string& key) {
  static const std::array<const char*, 4> kKeys = {"image_transport", "color_image_transport",
                                                   "diagnostic_period", "num_worker_threads"};
  static const std::array<const char*, 3> kSections = {"compressed/", "compressedDepth/",
                                                       "theora/"};
  return std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end() ||
         std::any_of(kSections.begin(), kSections.end(),
                     [&](const std::string& section) { return key.rfind(section, 0) == 0; });
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

}  // namespace dtsdf
