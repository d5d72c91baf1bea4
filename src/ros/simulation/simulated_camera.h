/// A depth camera, and a colour camera beside it, that move through an analytic room: input for the
/// demo and the tests.
#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <string>
#include <vector>

#include "dtsdf_mapping/params/param_set.h"
#include "simulation/scene.h"

namespace dtsdf {

enum class DepthFormat { k32FC1, k16UC1 };

struct SimulatedCameraParams {
  std::string map_frame = "map";
  std::string camera_frame = "camera_depth_optical_frame";
  std::string color_frame = "camera_color_optical_frame";
  bool color = true;  ///< A colour camera beside the depth camera, every second frame.
  DepthFormat encoding = DepthFormat::k16UC1;  ///< 16UC1 in millimetres, or 32FC1 in metres.
  int width_px = 320;
  int height_px = 240;
  double focal_px = 277.0;           ///< 60 degrees across at 320 pixels.
  double rate_hz = 10.0;             ///< Frames per second of wall time.
  double lap_s = 24.0;               ///< Time of one lap round the room.
  int moving = 0;                    ///< Balls that go round in the room.
  int frames = 0;                    ///< Ends after so many; 0: goes on for ever.
  bool wait_for_subscriber = false;  ///< The first frame waits until someone listens.
};

template <class Visitor>
void visitParams(SimulatedCameraParams& p, Visitor& visit) {
  visit("map_frame", p.map_frame);
  visit("camera_frame", p.camera_frame);
  visit("color_frame", p.color_frame);
  visit("color", p.color);
  visit("encoding", p.encoding,
        EnumNames<DepthFormat>{{"16UC1", DepthFormat::k16UC1}, {"32FC1", DepthFormat::k32FC1}});
  visit("width_px", p.width_px, Range{8, 4096});
  visit("height_px", p.height_px, Range{8, 4096});
  visit("focal_px", p.focal_px, Range{1.0, 1e5});
  visit("rate_hz", p.rate_hz, Range{0.1, 1000.0});
  visit("lap_s", p.lap_s, Range{0.1, 1e6});
  visit("moving", p.moving, Range{0, 100});
  visit("frames", p.frames, Range{0, 1 << 30});
  visit("wait_for_subscriber", p.wait_for_subscriber);
}

/// Publishes `depth/image_rect`, `depth/camera_info` and the camera's transform in the map frame;
/// and, of a colour camera 5 cm beside it, `color/image_rect` and `color/camera_info`: half as
/// often, between the depth images, larger, and with a wider view.
class SimulatedCamera {
 public:
  SimulatedCamera(ros::NodeHandle nh, const SimulatedCameraParams& params);

  /// Publishes until the frames are used up or ROS ends.
  void run();

 private:
  bool waitForSubscriber() const;
  void publishFrame(int index);
  void publishPose(const Eigen::Isometry3d& T_W_C, const ros::Time& stamp);
  void publishColour(double time_s, const ros::Time& stamp);
  sensor_msgs::Image makeImage(const std::vector<float>& depth_m, const ros::Time& stamp) const;
  Intrinsics intrinsicsOf(int width, int height) const;
  Scene sceneAt(double time_s) const;

  SimulatedCameraParams params_;
  Scene room_;
  image_transport::ImageTransport transport_;
  image_transport::Publisher images_, colour_images_;
  ros::Publisher infos_, colour_infos_;
  tf2_ros::TransformBroadcaster broadcaster_;
  tf2_ros::StaticTransformBroadcaster static_broadcaster_;
};

}  // namespace dtsdf
