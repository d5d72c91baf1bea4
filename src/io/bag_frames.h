/// Depth frames and colour images from a ROS bag, as FrameSource and ColourSource. The
/// implementation is in src/ros/bag; builds without ROS use src/tools/no_bag.cpp instead.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "dtsdf_mapping/io/recording.h"
#include "params/node_params.h"

namespace dtsdf {

/// camera_info is not needed for point clouds, nor if `intrinsics` are given.
struct BagOptions : RecordingOptions {
  std::string depth_topic;        ///< If empty, the bag's only topic with depth images.
  std::string info_topic;         ///< If empty, camera_info in the depth topic's namespace.
  std::string mask_topic;         ///< Masks with the depth images' stamps; optional.
  std::string colour_topic;       ///< If empty, the bag's only topic with colour images.
  std::string colour_info_topic;  ///< If empty, camera_info in the colour topic's namespace.
  std::string tf_topic;   ///< If empty, /tf. This topic + "_static" and /tf_static are also read.
  std::string imu_topic;  ///< If empty, the bag's only topic of type sensor_msgs/Imu.
  std::string map_frame = "map";  ///< Frame W.
  InputParams input;              ///< Camera frame, camera_info, units, rectification.
};

/// Opens a bag and reads its poses. Depth images are read on demand, one by one.
/// @throws std::runtime_error if the bag cannot be read, or if a topic is missing or ambiguous.
std::unique_ptr<FrameSource> openBagFrames(const BagOptions& options);

/// Opens a bag's colour images, sorted by stamp, each with the pose at its own stamp.
/// @return null if no topic is given and the bag does not contain exactly one topic with colour
/// images.
/// @throws std::runtime_error if the bag cannot be read or lacks the given topic.
std::unique_ptr<ColourSource> openBagColours(const BagOptions& options);

/// Determines the up direction in the map frame, as a unit vector, from the first period of one
/// second in which the bag's IMU is at rest and its transform to the map frame is known.
/// @throws std::runtime_error if there is no such period, if no IMU topic is given and the bag does
/// not contain exactly one, or if the poses come from a file.
Eigen::Vector3d findUpInBag(const BagOptions& options);

}  // namespace dtsdf
