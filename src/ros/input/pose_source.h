/// The camera's pose in the map frame at an image's stamp, from tf2.
#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "ros/input/transforms.h"

namespace dtsdf {

struct PoseAnswer {
  enum class Kind {
    kKnown,
    kNotYet,  ///< It may still come.
    kNever,   ///< The transforms known are all newer than the stamp.
  };
  Kind kind = Kind::kNotYet;
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();  ///< Only if known.
  std::string text;  ///< Unless known: what is missing, and what the newest transform is.
};

/// Thread safe, like the buffer, which somebody else fills.
class PoseSource {
 public:
  /// Poses in that frame; where it is empty, images have none, and identity is the answer.
  PoseSource(TransformBuffer& transforms, const std::string& map_frame);

  /// Of an image, which shows the buffer what time it is.
  PoseAnswer lookUp(const std::string& camera_frame, const ros::Time& stamp) const;

  /// Of any frame, by whoever asks; 0: by the newest transform.
  PoseAnswer find(const std::string& frame, const ros::Time& stamp) const {
    return find(map_frame_, frame, stamp, "the request");
  }

  /// Of a frame in another one that is fixed to it, by the newest transform.
  PoseAnswer findIn(const std::string& parent, const std::string& frame) const {
    return find(parent, frame, ros::Time(0), "the request");
  }

  /// Forgets all transforms that are not static, after a jump of time.
  void clear() { transforms_.clear(); }

  const std::string& mapFrame() const { return map_frame_; }

 private:
  /// `what` is of the stamp, in words.
  PoseAnswer find(const std::string& parent, const std::string& frame, const ros::Time& stamp,
                  const char* what) const;
  std::optional<ros::Time> findNewest(const std::string& parent, const std::string& frame) const;
  double beforeOldest_s(const std::string& parent, const std::string& frame, const ros::Time& stamp,
                        const ros::Time& newest) const;
  std::string describeFrames(const std::string& parent, const std::string& frame) const;
  std::string describe(const std::optional<ros::Time>& newest, const std::string& parent,
                       const std::string& frame, const ros::Time& stamp, const char* what) const;

  std::string map_frame_;
  TransformBuffer& transforms_;
};

}  // namespace dtsdf
