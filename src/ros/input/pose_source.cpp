#include "ros/input/pose_source.h"

#include <algorithm>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "params/printable.h"
#include "params/text.h"
#include "ros/input/conversions.h"

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
  const std::optional<ros::Time> newest = findNewest(parent, frame);
  PoseAnswer answer;
  try {
    answer.T_W_C = toIsometry(transforms_.core().lookupTransform(parent, frame, stamp).transform);
    answer.kind = PoseAnswer::Kind::kKnown;
    return answer;
  } catch (const std::runtime_error&) {
    // tf2's own exceptions, and that of ros::Duration where stamps lie over 68 years apart.
  }
  // The newest of a chain is the oldest of its links' newest: all links have gone past the image.
  if (newest && *newest >= stamp) answer.kind = PoseAnswer::Kind::kNever;
  answer.text = describe(newest, parent, frame, stamp, what);
  return answer;
}

std::optional<ros::Time> PoseSource::findNewest(const std::string& parent,
                                                const std::string& frame) const {
  try {
    return transforms_.core().lookupTransform(parent, frame, ros::Time(0)).header.stamp;
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

/// By how much a stamp lies before the first one that there are transforms for. tf2 does not say
/// where they begin, so that is searched for.
double PoseSource::beforeOldest_s(const std::string& parent, const std::string& frame,
                                  const ros::Time& stamp, const ros::Time& newest) const {
  constexpr double kExact_s = 1e-3;
  double without_s = 0.0, with_s = newest.toSec() - stamp.toSec();
  while (with_s - without_s > kExact_s) {
    const double middle_s = 0.5 * (without_s + with_s);
    const bool is_known =
        transforms_.core().canTransform(parent, frame, ros::Time(stamp.toSec() + middle_s));
    (is_known ? with_s : without_s) = middle_s;
  }
  return with_s;
}

/// Which frame TF lacks, and what to do.
std::string PoseSource::describeFrames(const std::string& parent, const std::string& frame) const {
  constexpr size_t kShown = 10;
  const std::vector<std::string> frames = transforms_.frames(std::numeric_limits<size_t>::max());
  if (frames.empty()) return "nothing has been received on /tf or /tf_static";
  const auto isKnown = [&](const std::string& name) {
    return std::binary_search(frames.begin(), frames.end(), name);
  };
  std::string names;
  for (size_t i = 0; i < std::min(frames.size(), kShown); ++i) {
    names += (i == 0 ? "'" : "', '") + printable(frames[i]);
  }
  names += frames.size() > kShown ? "' and more" : "'";
  if (!isKnown(parent)) {
    const std::string or_set = parent == map_frame_ ? "set map_frame to one of these, or " : "";
    return "TF has no frame '" + printable(parent) + "'; it has " + names + "; " + or_set +
           "start what publishes '" + printable(parent) + "'";
  }
  if (!isKnown(frame)) {
    return "TF has no frame '" + printable(frame) + "'; it has " + names +
           "; start what publishes '" + printable(frame) + "'";
  }
  return "TF has both frames, but no chain of transforms between them; it has " + names;
}

std::string PoseSource::describe(const std::optional<ros::Time>& newest, const std::string& parent,
                                 const std::string& frame, const ros::Time& stamp,
                                 const char* what) const {
  std::ostringstream text;
  text << "no transform from '" << printable(frame) << "' to '" << printable(parent) << "': ";
  if (!newest) {
    text << describeFrames(parent, frame);
  } else if (*newest >= stamp) {
    text << what << " is " << std::setprecision(3) << beforeOldest_s(parent, frame, stamp, *newest)
         << " s older than the oldest transform that is kept; normal for the first images only";
  } else {
    text << "the newest is stamped " << *newest << ", " << stamp.toSec() - newest->toSec()
         << " s before " << what << " of " << stamp;
  }
  return text.str();
}

}  // namespace dtsdf
