#include "ros/support/room_camera.h"

#include "ros/support/messages.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 160, kHeight = 120;
const Intrinsics kRoomIntrinsics{138.0f, 138.0f, 79.5f, 59.5f};

}  // namespace

RoomCamera::RoomCamera(ros::NodeHandle nh)
    : room_(makeRoomScene()),
      images_(nh, "/camera/depth"),
      transforms_(advertiseUntilExit<tf2_msgs::TFMessage>(nh, "/tf")) {}

bool RoomCamera::connect(uint32_t mappers) const {
  return waitUntil([&] {
    // The test itself also subscribes to /tf.
    return images_.isConnected(mappers) && transforms_.getNumSubscribers() > mappers;
  });
}

void RoomCamera::see(const Eigen::Isometry3d& T_R_C, const ros::Time& stamp) {
  const sensor_msgs::Image image =
      makeImageMessage(makeHeader(stamp, "camera"), "32FC1", kWidth, kHeight,
                       renderDepth(room_, kRoomIntrinsics, kWidth, kHeight, T_R_C));
  images_.send(image, makeCameraInfo(image, kRoomIntrinsics));
}

void RoomCamera::sendTransform(const std::string& parent, const std::string& child,
                               const Eigen::Isometry3d& T, const ros::Time& stamp) {
  transforms_.publish(makeTfMessage(parent, child, T, stamp));
}

OdometryWatcher::OdometryWatcher(ros::NodeHandle nh)
    : odometry_topic_(
          nh.subscribe<nav_msgs::Odometry>("/mapping/odometry", 1000,
                                           [this](const nav_msgs::Odometry::ConstPtr& message) {
                                             odometry_ = *message;
                                             ++count_;
                                           })),
      path_topic_(nh.subscribe<nav_msgs::Path>(
          "/mapping/path", 10,
          [this](const nav_msgs::Path::ConstPtr& message) { path_ = *message; })) {}

bool OdometryWatcher::waitFor(const ros::Time& stamp) const {
  return waitUntil([&] { return odometry_.header.stamp == stamp; });
}

Eigen::Isometry3d OdometryWatcher::pose() const {
  const geometry_msgs::Pose& pose = odometry_.pose.pose;
  geometry_msgs::Transform transform;
  transform.translation.x = pose.position.x;
  transform.translation.y = pose.position.y;
  transform.translation.z = pose.position.z;
  transform.rotation = pose.orientation;
  return toIsometry(transform);
}

std::optional<Eigen::Isometry3d> OdometryWatcher::transform(const std::string& parent,
                                                            const std::string& child,
                                                            const ros::Time& stamp) const {
  if (!waitUntil([&] { return buffer_.canTransform(parent, child, stamp); }, 10.0)) {
    return std::nullopt;
  }
  return toIsometry(buffer_.lookupTransform(parent, child, stamp).transform);
}

}  // namespace dtsdf
