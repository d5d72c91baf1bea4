/// Depth frames and colour images of a ROS bag behind their seams. Free of ROS headers: the
/// implementation (target dtsdf_bag, under src/ros/bag) is only there in a build with ROS.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "dtsdf_mapping/io/recording.h"
#include "params/node_params.h"

namespace dtsdf {

/// With intrinsics, camera_info need not be there.
struct BagOptions : RecordingOptions {
  std::string depth_topic;        ///< Empty: the bag's only topic with depth images.
  std::string info_topic;         ///< Empty: camera_info beside the depth topic.
  std::string mask_topic;         ///< Masks with the images' stamps; empty: none.
  std::string colour_topic;       ///< Empty: the bag's only topic with images in colour.
  std::string colour_info_topic;  ///< Empty: camera_info beside the colour topic.
  std::string tf_topic;           ///< Empty: /tf; static ones on this with _static, too.
  std::string imu_topic;          ///< Empty: the bag's only topic of type sensor_msgs/Imu.
  std::string map_frame = "map";  ///< Frame W.
  InputParams input;              ///< Camera's frame and its camera_info, units, rectification.
};

/// Opens a bag and reads its transforms; images are read one by one.
/// @throws std::runtime_error if it cannot be read or has no such topic.
std::unique_ptr<FrameSource> openBagFrames(const BagOptions& options);

/// Opens a bag's colour images, in the order of their stamps, each with the pose of its own frame
/// at its own stamp; null if no topic is named and there are none, or those of several cameras.
/// @throws std::runtime_error if the bag cannot be read or lacks the topic that is named.
std::unique_ptr<ColourSource> openBagColours(const BagOptions& options);

/// Up in the map frame, a unit vector, by the first second in which the bag's inertial sensor is
/// still and has a transform to the map frame.
/// @throws std::runtime_error if there is none, or there are several sensors and none is named.
Eigen::Vector3d findUpInBag(const BagOptions& options);

}  // namespace dtsdf
