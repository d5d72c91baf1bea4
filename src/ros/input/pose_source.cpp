#include "ros/input/pose_source.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "params/frame_name.h"
#include "params/printable.h"
#include "ros/input/transform_conversions.h"

namespace dtsdf {

PoseSource::PoseSource(TransformBuffer& transforms, const std::string& map_frame)
    : map_frame_(stripLeadingSlash(map_frame)), transforms_(transforms) {}

PoseAnswer PoseSource::lookUp(const std::string& camera_frame, const ros::Time& stamp) const {
  transforms_.imageCame(stamp);
  if (map_frame_.empty()) return {PoseAnswer::Kind::kKnown, Eigen::Isometry3d::Identity(), ""};
  return find(map_frame_, camera_frame, stamp, "the image");
}

PoseAnswer PoseSource::find(const std::string& parent, const std::string& frame,
                            const ros::Time& stamp, const char* what) const {
  transforms_.want(parent);
  transforms_.want(frame);
  // Before the look-up itself: a transform that arrives in between may not count as one that has
  // gone past the image.
  const NewestTransform newest = findNewest(parent, frame);
  PoseAnswer answer;
  try {
    answer.T_W_C = toIsometry(transforms_.core().lookupTransform(parent, frame, stamp).transform);
    answer.kind = PoseAnswer::Kind::kKnown;
    return answer;
  } catch (const std::runtime_error&) {
    // tf2's own exceptions, and that of ros::Duration where stamps lie over 68 years apart.
  }
  // The newest of a chain is the oldest of its links' newest: all links have gone past the image.
  if (newest.stamp && *newest.stamp >= stamp) answer.kind = PoseAnswer::Kind::kNever;
  answer.text = describe(newest, parent, frame, stamp, what);
  return answer;
}

PoseSource::NewestTransform PoseSource::findNewest(const std::string& parent,
                                                   const std::string& frame) const {
  try {
    return {transforms_.core().lookupTransform(parent, frame, ros::Time(0)).header.stamp, ""};
  } catch (const std::runtime_error& error) {
    return {std::nullopt, errorText(error)};
  }
}

std::string PoseSource::describeFrames() const {
  constexpr size_t kShown = 10;
  const std::vector<std::string> frames = transforms_.frames(kShown + 1);
  if (frames.empty()) return "no transform has been received on /tf or /tf_static";
  std::string text;
  for (size_t i = 0; i < std::min(frames.size(), kShown); ++i) {
    text += (i == 0 ? "known frames: '" : "', '") + printable(frames[i]);
  }
  return text + (frames.size() > kShown ? "' and more" : "'");
}

std::string PoseSource::describe(const NewestTransform& newest, const std::string& parent,
                                 const std::string& frame, const ros::Time& stamp,
                                 const char* what) const {
  std::ostringstream text;
  text << "no transform from '" << printable(frame) << "' to '" << printable(parent) << "': ";
  if (!newest.stamp) {
    text << "none has ever been received (" << newest.error << "); " << describeFrames();
    return text.str();
  }
  const double ahead_s = stamp.toSec() - newest.stamp->toSec();
  text << "the newest is stamped " << *newest.stamp << ", " << std::abs(ahead_s) << " s "
       << (ahead_s > 0.0 ? "before" : "after") << " " << what << " of " << stamp;
  return text.str();
}

}  // namespace dtsdf
