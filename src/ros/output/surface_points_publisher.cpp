#include "ros/output/surface_points_publisher.h"

#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>

#include "ros/common/callback_guard.h"

namespace dtsdf {
namespace {

using Point = pcl::PointXYZRGBNormal;
using Cloud = pcl::PointCloud<Point>;

Point toPoint(const Mesh& mesh, size_t vertex, MeshColour colour) {
  const Vec3f& p_W = mesh.vertices_m[vertex];
  const Vec3f& normal_W = mesh.normals[vertex];
  Point point;
  point.x = p_W.x;
  point.y = p_W.y;
  point.z = p_W.z;
  point.normal_x = normal_W.x;
  point.normal_y = normal_W.y;
  point.normal_z = normal_W.z;
  const std::array<uint8_t, 3> rgb = vertexColour(colour, mesh, vertex);
  point.r = rgb[0];
  point.g = rgb[1];
  point.b = rgb[2];
  point.a = 255;
  return point;
}

}  // namespace

SurfacePointsPublisher::SurfacePointsPublisher(ros::NodeHandle nh, const std::string& map_frame,
                                               MeshColour colour)
    : map_frame_(map_frame), colour_(colour) {
  publisher_ = nh.advertise<Cloud>("surface_points", 1,
                                   [this](const ros::SingleSubscriberPublisher&) {
                                     guarded("new subscriber of surface_points",
                                             [this] { noteChanges(); });
                                   });
}

void SurfacePointsPublisher::publish(const Mesh& mesh, const ros::Time& stamp) {
  outdated_ = false;
  Cloud cloud;
  cloud.header.frame_id = map_frame_;
  cloud.header.stamp = pcl_conversions::toPCL(stamp);
  cloud.reserve(mesh.vertices_m.size());
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    cloud.push_back(toPoint(mesh, i, colour_));
  }
  publisher_.publish(cloud);
}

}  // namespace dtsdf
