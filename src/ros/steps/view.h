/// The step that publishes what the camera would see of the map, as a depth camera does, while
/// someone listens.
#pragma once

#include <ros/node_handle.h>

#include "dtsdf_mapping/rendered_view.h"
#include "ros/common/pace.h"
#include "ros/steps/step.h"

namespace dtsdf {

class ViewStep : public Step {
 public:
  explicit ViewStep(const Host& host);

  void advertise(const Handles& handles) override;
  /// Renders the map from the pose of the frame.
  void fused(const PosedFrame& frame, const IntegrationResult& result) override;

 private:
  const Host& host_;
  Pace pace_;
  RenderedView view_;
  ros::Publisher images_, infos_;
};

}  // namespace dtsdf
