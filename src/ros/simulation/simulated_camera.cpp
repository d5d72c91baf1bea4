/// Simulates a depth and colour camera that moves through an analytic room, for the demo and the
/// tests.
#include <cv_bridge/cv_bridge.h>
#include <image_transport/image_transport.h>
#include <ros/ros.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2_ros/transform_broadcaster.h>

#include <cmath>
#include <string>
#include <vector>

#include "ros/common/node_start.h"
#include "ros/input/conversions.h"
#include "ros/input/images.h"
#include "simulation/scene.h"

namespace dtsdf {
namespace {

constexpr char kUsage[] =
    "usage: rosrun dtsdf_mapping simulated_camera [_SETTING:=VALUE...] [TOPIC:=OTHER_TOPIC...]\n\n"
    "Publishes depth and colour images of a simulated room, with camera_info and TF, for the\n"
    "demo and for tests. Needs a ROS master.\n\n"
    "Topics: depth/image_rect, depth/camera_info, color/image_rect, color/camera_info, /tf.\n";

struct SimulatedCameraParams {
  std::string map_frame = "map";
  std::string camera_frame = "camera_depth_optical_frame";
  bool color = true;           ///< Publishes a colour image with every second frame.
  bool in_millimetres = true;  ///< Depth is 16UC1; else 32FC1, in metres.
  int width_px = 320;
  int height_px = 240;
  double focal_px = 277.0;  ///< Field of view: 60 degrees at 320 pixels.
  double rate_hz = 10.0;    ///< Frames per second of wall time.
  double lap_s = 24.0;      ///< Duration of a lap around the room.
  int moving = 0;           ///< Number of balls that circle in the room.
};

template <class Visitor>
void visitParams(SimulatedCameraParams& p, Visitor& visit) {
  visit("map_frame", p.map_frame);
  visit("camera_frame", p.camera_frame);
  visit("color", p.color);
  visit("encoding", p.in_millimetres, EnumNames<bool>{{"16UC1", true}, {"32FC1", false}});
  visit("width_px", p.width_px, Range{8, 4096});
  visit("height_px", p.height_px, Range{8, 4096});
  visit("focal_px", p.focal_px, Range{1.0, 1e5});
  visit("rate_hz", p.rate_hz, Range{0.1, 1000.0});
  visit("lap_s", p.lap_s, Range{0.1, 1e6});
  visit("moving", p.moving, Range{0, 100});
}

namespace enc = sensor_msgs::image_encodings;

/// Publishes `depth/image_rect`, `depth/camera_info` and the transform from the camera to the map
/// frame; and, with every second frame, `color/image_rect` and `color/camera_info`.
class SimulatedCamera {
 public:
  SimulatedCamera(ros::NodeHandle nh, const SimulatedCameraParams& params)
      : params_(params),
        room_(makeRoomScene()),
        transport_(nh),
        images_(transport_.advertise("depth/image_rect", 5)),
        infos_(nh.advertise<sensor_msgs::CameraInfo>("depth/camera_info", 5)) {
    if (!params_.color) return;
    colour_images_ = transport_.advertise("color/image_rect", 5);
    colour_infos_ = nh.advertise<sensor_msgs::CameraInfo>("color/camera_info", 5);
  }

  /// Publishes until ROS shuts down.
  void run() {
    ros::WallRate rate(params_.rate_hz);
    for (int i = 0; ros::ok(); ++i) {
      publishFrame(i);
      ros::spinOnce();
      rate.sleep();
    }
  }

 private:
  void publishFrame(int index) {
    const ros::Time stamp = ros::Time::now();
    if (index == 0) first_stamp_ = stamp;
    // The pose depends on the stamp, so that late images do not make the camera jump.
    const double time_s = (stamp - first_stamp_).toSec();
    const Eigen::Isometry3d T_W_C = roomCameraPose(time_s, params_.lap_s);
    broadcaster_.sendTransform(
        makeTransform(params_.map_frame, params_.camera_frame, T_W_C, stamp));
    const auto focal_px = static_cast<float>(params_.focal_px);
    const Intrinsics K{focal_px, focal_px, 0.5f * static_cast<float>(params_.width_px - 1),
                       0.5f * static_cast<float>(params_.height_px - 1)};
    const std::vector<float> depth_m =
        renderDepth(sceneAt(time_s), K, params_.width_px, params_.height_px, T_W_C);
    const sensor_msgs::ImagePtr image = makeImage(depth_m, stamp);
    images_.publish(image);
    const sensor_msgs::CameraInfo info = makeCameraInfo(*image, K);
    infos_.publish(info);
    if (params_.color && index % 2 == 1) publishColour(time_s, T_W_C, info);
  }

  void publishColour(double time_s, const Eigen::Isometry3d& T_W_C,
                     const sensor_msgs::CameraInfo& info) {
    std::vector<Paint> paint = renderPaint(sceneAt(time_s), intrinsicsOf(info), params_.width_px,
                                           params_.height_px, T_W_C);
    const cv::Mat pixels(params_.height_px, params_.width_px, CV_8UC3, paint.data());
    colour_images_.publish(cv_bridge::CvImage(info.header, enc::RGB8, pixels).toImageMsg());
    colour_infos_.publish(info);
  }

  sensor_msgs::ImagePtr makeImage(std::vector<float> depth_m, const ros::Time& stamp) const {
    cv_bridge::CvImage image;
    image.header.stamp = stamp;
    image.header.frame_id = params_.camera_frame;
    image.image = cv::Mat(params_.height_px, params_.width_px, CV_32FC1, depth_m.data());
    if (params_.in_millimetres) {
      image.encoding = enc::TYPE_16UC1;
      image.image.convertTo(image.image, CV_16UC1, 1000.0);
    } else {
      image.encoding = enc::TYPE_32FC1;
      image.image.setTo(NAN, image.image <= 0.0f);
    }
    return image.toImageMsg();
  }

  Scene sceneAt(double time_s) const {
    Scene scene = room_;
    for (const Sphere& ball : roomBalls(params_.moving, time_s)) scene.add(ball);
    return scene;
  }

  SimulatedCameraParams params_;
  Scene room_;
  ros::Time first_stamp_;
  image_transport::ImageTransport transport_;
  image_transport::Publisher images_, colour_images_;
  ros::Publisher infos_, colour_infos_;
  tf2_ros::TransformBroadcaster broadcaster_;
};

SimulatedCameraParams readParams(const ros::NodeHandle& private_nh) {
  std::vector<ParamViolation> violations;
  ParamReader reader(readParamServer(private_nh, violations));
  SimulatedCameraParams params;
  visitParams(params, reader);
  for (const auto& [key, rule] : violations) reader.addViolation(key, rule);
  reader.finish();
  return params;
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  using namespace dtsdf;
  return runNode(argc, argv, "simulated_camera", kUsage, toTree(SimulatedCameraParams()),
                 [](const ros::NodeHandle& nh, const ros::NodeHandle& private_nh) {
                   SimulatedCamera(nh, readParams(private_nh)).run();
                 });
}
