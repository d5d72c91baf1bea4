#include "dtsdf_mapping/ros/pose_source.h"

#include <geometry_msgs/TransformStamped.h>

#include <cmath>
#include <sstream>

#include "dtsdf_mapping/ros/node_params.h"

namespace dtsdf {
namespace {

Eigen::Isometry3d toIsometry(const geometry_msgs::Transform& transform) {
  const geometry_msgs::Quaternion& q = transform.rotation;
  const geometry_msgs::Vector3& t = transform.translation;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  T.translation() << t.x, t.y, t.z;
  return T;
}

}  // namespace

PoseSource::PoseSource(const ros::NodeHandle& nh, const std::string& map_frame)
    : map_frame_(stripLeadingSlash(map_frame)), listener_(buffer_, nh, true) {}

PoseAnswer PoseSource::lookUp(const std::string& camera_frame, const ros::Time& stamp) const {
  try {
    PoseAnswer answer;
    answer.T_W_C = toIsometry(buffer_.lookupTransform(map_frame_, camera_frame, stamp).transform);
    answer.kind = PoseAnswer::Kind::kKnown;
    return answer;
  } catch (const tf2::TransformException& error) {
    return explainFailure(camera_frame, stamp, error.what());
  }
}

PoseAnswer PoseSource::explainFailure(const std::string& camera_frame, const ros::Time& stamp,
                                      const std::string& error) const {
  PoseAnswer answer;
  std::ostringstream text;
  text << "no transform from '" << camera_frame << "' to '" << map_frame_ << "': ";
  try {
    const ros::Time newest =
        buffer_.lookupTransform(map_frame_, camera_frame, ros::Time(0)).header.stamp;
    const double ahead_s = (stamp - newest).toSec();
    text << "the newest one is of " << newest << ", " << std::abs(ahead_s) << " s "
         << (ahead_s > 0.0 ? "before" : "after") << " the image of " << stamp;
    // The newest one is the oldest of the chain's newest links: all have gone past the image.
    if (ahead_s <= 0.0) answer.kind = PoseAnswer::Kind::kNever;
  } catch (const tf2::TransformException&) {
    text << "there is none of any time (" << error << ")";
  }
  answer.text = text.str();
  return answer;
}

}  // namespace dtsdf
