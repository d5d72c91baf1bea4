#include "ros/support/fake_camera.h"

#include <vector>

#include "ros/support/messages.h"
#include "ros/support/wait.h"

namespace dtsdf {

FakeCamera::FakeCamera(ros::NodeHandle nh)
    : images_(nh, "/camera/depth"),
      transforms_(advertiseUntilExit<tf2_msgs::TFMessage>(nh, "/tf")) {}

bool FakeCamera::connect() const {
  return waitUntil([&] { return images_.isConnected() && transforms_.getNumSubscribers() > 0; });
}

ros::Time FakeCamera::nextStamp() {
  const ros::Time now = ros::Time::now();
  const ros::Time earliest = last_stamp_ + ros::Duration(0.01);
  last_stamp_ = now > earliest ? now : earliest;
  return last_stamp_;
}

sensor_msgs::Image FakeCamera::image(const ros::Time& stamp) const {
  return makeImageMessage(makeHeader(stamp, "camera"), "32FC1", kWidth, kHeight,
                          std::vector<float>(kWidth * kHeight, 1.0f));
}

sensor_msgs::CameraInfo FakeCamera::info(const ros::Time& stamp) const {
  return makeCameraInfo(image(stamp), kIntrinsics);
}

void FakeCamera::sendTransform(const ros::Time& stamp, const Eigen::Vector3d& t_W,
                               const std::string& frame) {
  sendPose(Eigen::Isometry3d(Eigen::Translation3d(t_W)), stamp, frame);
}

void FakeCamera::sendPose(const Eigen::Isometry3d& T_W_F, const ros::Time& stamp,
                          const std::string& frame) {
  broadcaster_.sendTransform(makeTransform("map", frame, T_W_F, stamp));
}

ros::Time FakeCamera::sendFrame() {
  const ros::Time stamp = nextStamp();
  sendTransform(stamp);
  send(image(stamp), info(stamp));
  return stamp;
}

}  // namespace dtsdf
