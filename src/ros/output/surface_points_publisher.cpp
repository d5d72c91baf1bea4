#include "ros/output/surface_points_publisher.h"

#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>
#include <ros/console.h>

#include <algorithm>

namespace dtsdf {
namespace {

using Point = pcl::PointXYZRGBNormal;
using Cloud = pcl::PointCloud<Point>;

Point toPoint(const Mesh& mesh, size_t vertex, MeshColour colour) {
  const std::array<double, 3> p_W = positionInMap(mesh, vertex);
  const Vec3f& normal_W = mesh.normals[vertex];
  Point point;
  point.x = static_cast<float>(p_W[0]);
  point.y = static_cast<float>(p_W[1]);
  point.z = static_cast<float>(p_W[2]);
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

SurfacePointsPublisher::SurfacePointsPublisher(const ros::NodeHandle& nh,
                                               const std::string& map_frame, MeshColour colour)
    : map_frame_(map_frame), colour_(colour), topic_(nh, topicOf<Cloud>("surface_points")) {}

bool SurfacePointsPublisher::isDue() {
  const ListenerTopic::Links& links = topic_.links();
  return std::any_of(links.begin(), links.end(),
                     [](const auto& link) { return link->lacksNewest(); });
}

void SurfacePointsPublisher::publish(const Mesh& mesh, const ros::Time& stamp) {
  if (isFarFromOrigin(mesh)) {
    ROS_WARN_STREAM_ONCE_NAMED(
        "dtsdf_mapping", topic_.report().topic
                             << " has float positions, which are 0.5 mm apart 8 km from the "
                                "origin of the map and 4 mm at 40 km; mesh_blocks and mesh have "
                                "doubles");
  }
  Cloud cloud;
  cloud.header.frame_id = map_frame_;
  cloud.header.stamp = pcl_conversions::toPCL(stamp);
  // Of one at least: pcl_ros copies from where they are, even none, and that has to be an address.
  cloud.reserve(std::max<size_t>(1, mesh.vertices_m.size()));
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    cloud.push_back(toPoint(mesh, i, colour_));
  }
  topic_.sendNewest(ros::serialization::serializeMessage(cloud));
}

}  // namespace dtsdf
