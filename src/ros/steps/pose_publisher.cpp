#include "ros/steps/pose_publisher.h"

#include <nav_msgs/Odometry.h>
#include <ros/console.h>

#include <Eigen/Eigenvalues>
#include <chrono>

#include "params/printable.h"
#include "ros/input/conversions.h"

namespace dtsdf {
namespace {

/// Of the prior's variance, beyond which an axis is free.
constexpr double kFreeShare = 0.25;

/// Variances of what is not known, which filters still can work with.
constexpr double kUnknown_m2 = 1e3, kUnknown_rad2 = 10.0;

Eigen::Matrix3d sumOfSquares(const std::vector<Eigen::Vector3d>& axes) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& axis : axes) sum += axis * axis.transpose();
  return sum;
}

Eigen::Matrix3d crossProductBy(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

}  // namespace

std::vector<Eigen::Vector3d> freeAxes(const Eigen::Matrix3d& covariance, double sigma) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  std::vector<Eigen::Vector3d> axes;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (solver.eigenvalues()[i] <= kFreeShare * sigma * sigma) continue;
    axes.emplace_back(solver.eigenvectors().col(i));
  }
  return axes;
}

Matrix6d odometryCovariance(const Alignment& alignment, const PoseParams& params) {
  Matrix6d covariance = alignment.covariance;
  // What was not aligned is where it was given, such as the first image.
  const bool adds_up =
      params.mode == PoseMode::kTrack && alignment.status == AlignmentStatus::kAligned;
  if (!adds_up) return covariance;
  const Eigen::Matrix3d shifts = covariance.topLeftCorner<3, 3>();
  const Eigen::Matrix3d turns = covariance.bottomRightCorner<3, 3>();
  covariance.topLeftCorner<3, 3>() += kUnknown_m2 * sumOfSquares(freeAxes(shifts, params.sigma_m));
  covariance.bottomRightCorner<3, 3>() +=
      kUnknown_rad2 * sumOfSquares(freeAxes(turns, params.sigma_rad));
  return covariance;
}

Matrix6d movedCovariance(const Matrix6d& covariance, const Eigen::Matrix3d& R_M_W,
                         const Eigen::Vector3d& offset_M) {
  Matrix6d jacobian = Matrix6d::Zero();
  jacobian.topLeftCorner<3, 3>() = R_M_W;
  jacobian.topRightCorner<3, 3>() = -crossProductBy(offset_M) * R_M_W;
  jacobian.bottomRightCorner<3, 3>() = R_M_W;
  return jacobian * covariance * jacobian.transpose();
}

namespace {

/// Poses on the path are so far apart, and so many at most: then every second one goes.
constexpr double kApart_m = 0.03, kApart_rad = 0.1;
constexpr size_t kMostOnPath = 4000;
constexpr std::chrono::milliseconds kPathPeriod{500};

/// Variance of a speed, none of which is measured.
constexpr double kNoSpeed = 1e6;

geometry_msgs::Pose toPose(const Eigen::Isometry3d& T) {
  const geometry_msgs::Transform transform = toTransform(T);
  geometry_msgs::Pose pose;
  pose.position.x = transform.translation.x;
  pose.position.y = transform.translation.y;
  pose.position.z = transform.translation.z;
  pose.orientation = transform.rotation;
  return pose;
}

bool areApart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const double turn_rad = Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
  return (a.translation() - b.translation()).norm() >= kApart_m || turn_rad >= kApart_rad;
}

std::string parentOfBase(const NodeParams& params) {
  const bool under_odom = params.poses.mode == PoseMode::kTrack && !params.poses.odom_frame.empty();
  return under_odom ? params.poses.odom_frame : params.map_frame;
}

}  // namespace

PosePublisher::PosePublisher(ros::NodeHandle private_nh, const NodeParams& params,
                             const Transforms& transforms)
    : params_(params),
      parent_(parentOfBase(params)),
      transforms_(transforms),
      odometry_(private_nh.advertise<nav_msgs::Odometry>("odometry", 100)),
      path_topic_(private_nh.advertise<nav_msgs::Path>("path", 1, true)) {
  path_.header.frame_id = frameOfMap(params);
}

void PosePublisher::publish(const FoundPose& pose) {
  publishOdometry(pose);
  addToPath(pose);
  if (!tracks()) return;
  if (parent_ != params_.map_frame) {
    sendTransform(params_.map_frame, parent_, Eigen::Isometry3d::Identity(), pose.stamp);
  }
  sendTransform(parent_, pose.frame_id, pose.T_M_B, pose.stamp);
}

void PosePublisher::publishCorrection(const ros::Time& stamp, const Eigen::Isometry3d& T_M_O) {
  const std::string& odom_frame = params_.poses.odom_frame;
  if (!tracks() && !odom_frame.empty()) sendTransform(params_.map_frame, odom_frame, T_M_O, stamp);
}

void PosePublisher::publishOdometry(const FoundPose& pose) {
  nav_msgs::Odometry odometry;
  odometry.header.stamp = pose.stamp;
  odometry.header.frame_id = parent_;
  odometry.child_frame_id = pose.frame_id;
  odometry.pose.pose = toPose(pose.T_M_B);
  using RowByRow = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  Eigen::Map<RowByRow>(odometry.pose.covariance.data()) = pose.covariance;
  Eigen::Map<RowByRow>(odometry.twist.covariance.data()).diagonal().setConstant(kNoSpeed);
  odometry_.publish(odometry);
}

void PosePublisher::addToPath(const FoundPose& pose) {
  if (path_.poses.empty() || areApart(pose.T_W_B, last_on_path_T_W_B_)) {
    geometry_msgs::PoseStamped stamped;
    stamped.header.stamp = pose.stamp;
    stamped.header.frame_id = path_.header.frame_id;
    stamped.pose = toPose(pose.T_W_B);
    path_.poses.push_back(stamped);
    last_on_path_T_W_B_ = pose.T_W_B;
  }
  if (path_.poses.size() > kMostOnPath) {
    size_t kept = 0;
    for (size_t i = 0; i < path_.poses.size(); i += 2) path_.poses[kept++] = path_.poses[i];
    path_.poses.resize(kept);
  }
  const SteadyTime now = std::chrono::steady_clock::now();
  if (path_topic_.getNumSubscribers() == 0 || now - path_sent_ < kPathPeriod) return;
  path_sent_ = now;
  path_.header.stamp = pose.stamp;
  path_topic_.publish(path_);
}

void PosePublisher::clearPath() {
  path_.poses.clear();
  path_topic_.publish(path_);
}

void PosePublisher::sendTransform(const std::string& parent, const std::string& child,
                                  const Eigen::Isometry3d& T, const ros::Time& stamp) {
  const std::string other = transforms_.otherParentOf(child, parent);
  if (!other.empty()) {
    const std::lock_guard<std::mutex> lock(mutex_);
    problem_ = "poses are not published in TF, where '" + printable(child) + "' has the parent '" +
               printable(other) + "' already: set poses/base_frame to the root of the camera's " +
               "own frames, or end what else publishes the pose";
    ROS_WARN_STREAM_THROTTLE_NAMED(60.0, "dtsdf_mapping", problem_);
    return;
  }
  broadcaster_.sendTransform(makeTransform(parent, child, T, stamp));
}

std::string PosePublisher::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

}  // namespace dtsdf
