#include "ros/node/mapping_node.h"

#include <dtsdf_mapping/PublishConfig.h>
#include <dynamic_reconfigure/server.h>

#include "ros/common/callback_guard.h"
#include "ros/node/pipeline.h"
#include "ros/node/status.h"

namespace dtsdf {
namespace {

class MappingNode {
 public:
  MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
      : pipeline_(nh, private_nh),
        status_(nh, private_nh, frameOfMap(pipeline_.params().node),
                pipeline_.params().node.publish.status_rate_hz,
                [this](dtsdf_mapping::MapStatus& status) { pipeline_.fill(status); }),
        rates_(ros::NodeHandle(private_nh, "publish")) {
    rates_.setCallback([this](const dtsdf_mapping::PublishConfig& config, uint32_t) {
      guarded("rates", [&] { setRates(config); });
    });
  }

 private:
  void setRates(const dtsdf_mapping::PublishConfig& config) {
    PublishParams rates = pipeline_.params().node.publish;
    rates.mesh_rate_hz = config.mesh_rate_hz;
    rates.points_rate_hz = config.points_rate_hz;
    rates.status_rate_hz = config.status_rate_hz;
    rates.space_rate_hz = config.space_rate_hz;
    status_.setRate(rates.status_rate_hz);
    pipeline_.setRates(rates);
  }

  // They end from the outside in: nothing calls into a part that is gone.
  Pipeline pipeline_;
  StatusPublisher status_;
  /// Below `publish/`, so that its keys are those of the settings.
  dynamic_reconfigure::Server<dtsdf_mapping::PublishConfig> rates_;
};

}  // namespace

std::shared_ptr<void> startMapping(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh) {
  return std::make_shared<MappingNode>(nh, private_nh);
}

}  // namespace dtsdf
