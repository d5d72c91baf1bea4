/// The rates, for those who change them while the node runs.
#pragma once

#include <dtsdf_mapping/PublishConfig.h>
#include <dynamic_reconfigure/server.h>
#include <ros/node_handle.h>

#include <functional>

#include "params/node_params.h"
#include "ros/common/callback_guard.h"

namespace dtsdf {

/// Serves dynamic_reconfigure below `publish/`, so that its keys are those of the settings.
class RateServer {
 public:
  using OnRates = std::function<void(const PublishParams&)>;

  /// `params` has what is not changed; `on_rates` is called by the queue of the node handle.
  RateServer(const ros::NodeHandle& private_nh, const PublishParams& params, OnRates on_rates)
      : server_(ros::NodeHandle(private_nh, "publish")) {
    server_.setCallback([params, on_rates](dtsdf_mapping::PublishConfig& config, uint32_t) {
      PublishParams changed = params;
      changed.mesh_rate_hz = config.mesh_rate_hz;
      changed.points_rate_hz = config.points_rate_hz;
      changed.status_rate_hz = config.status_rate_hz;
      changed.space_rate_hz = config.space_rate_hz;
      guarded("rates", [&] { on_rates(changed); });
    });
  }

 private:
  dynamic_reconfigure::Server<dtsdf_mapping::PublishConfig> server_;
};

}  // namespace dtsdf
