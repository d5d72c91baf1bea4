/// Depth frames and colour images of a ROS bag, as FrameSource and ColourSource. The implementation
/// is in src/ros/bag; in builds without ROS, src/tools/no_bag.cpp stands in for it.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "dtsdf_mapping/io/recording.h"
#include "params/node_params.h"

namespace dtsdf {

/// camera_info is not needed for clouds, or if `intrinsics` are given.
struct BagOptions : RecordingOptions {
  std::string depth_topic;        ///< Empty: the bag's only topic with depth images.
  std::string info_topic;         ///< Empty: camera_info next to the depth topic.
  std::string mask_topic;         ///< Masks with the depth images' stamps; empty: none.
  std::string colour_topic;       ///< Empty: the bag's only topic with colour images.
  std::string colour_info_topic;  ///< Empty: camera_info next to the colour topic.
  std::string tf_topic;   ///< Empty: /tf. Static transforms: this plus _static, and /tf_static.
  std::string imu_topic;  ///< Empty: the bag's only topic of type sensor_msgs/Imu.
  std::string map_frame = "map";  ///< Frame W.
  InputParams input;              ///< Camera frame, camera_info, units, rectification.
};

/// Opens a bag and reads its poses. Depth images are read later, one by one.
/// @throws std::runtime_error if it cannot be read, or if a topic is missing or must be chosen.
std::unique_ptr<FrameSource> openBagFrames(const BagOptions& options);

/// Opens a bag's colour images, sorted by stamp, each with the pose at its own stamp.
/// @return null if no topic is named and the bag has no topic with colour images, or several.
/// @throws std::runtime_error if the bag cannot be read or does not have the named topic.
std::unique_ptr<ColourSource> openBagColours(const BagOptions& options);

/// Finds the up direction in the map frame, a unit vector, from the first second in which the bag's
/// IMU is at rest and has a transform to the map frame.
/// @throws std::runtime_error if there is no such second, if no IMU is named and the bag has none
/// or several, or with poses from a file.
Eigen::Vector3d findUpInBag(const BagOptions& options);

}  // namespace dtsdf
