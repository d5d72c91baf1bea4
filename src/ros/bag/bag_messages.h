/// What images of a bag need beside themselves, whatever kind they are: topics, camera_info, poses.
#pragma once

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>
#include <std_msgs/Header.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "io/bag_frames.h"
#include "io/trajectory.h"
#include "params/printable.h"

namespace dtsdf {

bool hasMessages(const rosbag::Bag& bag, const std::string& topic);

/// @throws std::runtime_error if it has none.
void requireMessages(const rosbag::Bag& bag, const std::string& topic);

/// The topics whose first message is wanted. An image that was recorded both ways counts once, as
/// it was before it was compressed.
std::set<std::string> findImageTopics(
    const rosbag::Bag& bag, const std::function<bool(const rosbag::MessageInstance&)>& is_wanted);

/// " '/a' '/b'".
std::string inList(const std::set<std::string>& topics);

/// What `read` returns. @throws std::runtime_error in place of an exception of rosbag.
template <class Read>
auto readingBag(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read the bag '" + path + "': " + errorText(error) +
                             "; try rosbag reindex, or rosbag fix");
  }
}

/// The poses of cameras: from the transforms of the whole bag, or a trajectory in their place.
class BagPoses {
 public:
  /// @throws std::runtime_error if the trajectory cannot be read.
  BagPoses(const rosbag::Bag& bag, const BagOptions& options);

  /// Of the image with this header; if there is none, why.
  std::optional<Eigen::Isometry3d> of(const std_msgs::Header& header,
                                      std::string* why_none = nullptr) const;

  /// Why an image has no pose.
  std::string whyNone() const;

  /// @throws std::runtime_error if no image with this header can have one, as the bag's transforms
  /// lack a frame; it names those that there are.
  void requireFrames(const std_msgs::Header& header, const std::string& bag_path) const;

 private:
  void readTransforms(const rosbag::Bag& bag);
  std::string cameraFrame(const std_msgs::Header& header) const;

  BagOptions options_;  ///< Frames without leading slashes.
  size_t refused_ = 0;
  std::set<std::string> others_;  ///< Topics with transforms, where the bag has none on that named.
  tf2::BufferCore transforms_;
  std::optional<Trajectory> trajectory_;  ///< In place of the transforms.
};

}  // namespace dtsdf
