#include "dtsdf_mapping/ros/pose_source.h"

#include <tf2/exceptions.h>

#include <cmath>
#include <sstream>

#include "dtsdf_mapping/ros/transform_conversions.h"

namespace dtsdf {
namespace {

/// Longer than any frame waits in a queue that keeps up.
constexpr double kKept_s = 30.0;

}  // namespace

PoseSource::PoseSource(const ros::NodeHandle& nh, const std::string& map_frame)
    : map_frame_(stripLeadingSlash(map_frame)),
      buffer_(ros::Duration(kKept_s)),
      listener_(buffer_, nh, true) {}

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
