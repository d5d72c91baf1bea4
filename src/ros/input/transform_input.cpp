#include "ros/input/transform_input.h"

#include <ros/console.h>

#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {
namespace {

/// Messages that may wait; as many as tf2's own listener lets wait.
constexpr uint32_t kQueue = 100;

}  // namespace

TransformInput::TransformInput(const ros::NodeHandle& nh, TransformBuffer& transforms)
    : nh_(nh),
      transforms_(transforms),
      tf_(nh_.subscribe("/tf", kQueue, &TransformInput::onTransforms, this)) {
  subscribeStatic();
  timer_ = nh_.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) {
    guarded("static transforms", [this] {
      if (transforms_.takeStaticsWanted()) subscribeStatic();
    });
  });
}

/// Publishers of static transforms are latched: a new subscriber gets what they sent last. The one
/// before it ends only then, so roscpp keeps the connections: it bears no loss of one of them while
/// a message comes.
void TransformInput::subscribeStatic() {
  tf_static_ = nh_.subscribe("/tf_static", kQueue, &TransformInput::onStaticTransforms, this);
}

void TransformInput::onTransforms(const Event& event) {
  guarded("transforms", [&] { put(event, false); });
}

void TransformInput::onStaticTransforms(const Event& event) {
  guarded("static transforms", [&] { put(event, true); });
}

void TransformInput::put(const Event& event, bool is_static) {
  if (ros::Time::isSimTime()) {
    const ros::Time now = ros::Time::now();
    const ros::Time last = std::exchange(last_now_, now);
    if (now < last) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", "simulated time went back from "
                                                 << last << " to " << now
                                                 << ": transforms are discarded");
      transforms_.clear();
    }
  }
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    transforms_.setTransform(transform, event.getPublisherName(), is_static);
  }
}

}  // namespace dtsdf
