/// The step that publishes the vertices of the mesh as a point cloud, while someone listens.
#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>

#include <algorithm>
#include <atomic>

#include "dtsdf_mapping/mesh.h"
#include "ros/common/topic.h"
#include "ros/steps/make_steps.h"

namespace dtsdf {
namespace {

using Point = pcl::PointXYZRGBNormal;
using Cloud = pcl::PointCloud<Point>;

Point toPoint(const Mesh& mesh, size_t vertex, MeshColour colour) {
  const std::array<double, 3> p_W = positionInMap(mesh, vertex);
  const Vec3f& normal_W = mesh.normals[vertex];
  Point point;
  point.getVector3fMap() = Eigen::Vector3d(p_W[0], p_W[1], p_W[2]).cast<float>();
  point.getNormalVector3fMap() = Eigen::Vector3f(normal_W.x, normal_W.y, normal_W.z);
  const std::array<uint8_t, 3> rgb = vertexColour(colour, mesh, vertex);
  point.r = rgb[0];
  point.g = rgb[1];
  point.b = rgb[2];
  point.a = 255;
  return point;
}

/// Publishes `surface_points`; each cloud holds the whole mesh.
class PointsStep : public Step {
 public:
  explicit PointsStep(const Host& host) : host_(host), pace_(host.points_hz) {}

  void advertise(const Handles& handles) override {
    topic_.advertise<Cloud>(handles.prompt, "surface_points", 1,
                            [this](const auto&) { is_outdated_ = true; });
  }

  std::optional<double> meshRate_hz() const override {
    return topic_.hasSubscribers() ? std::optional<double>(host_.points_hz) : std::nullopt;
  }

  void changed(const MeshChanges&) override { is_outdated_ = true; }
  SteadyDuration publish(ShownMesh* mesh) override {
    if (mesh == nullptr || !is_outdated_ || !topic_.hasSubscribers()) return SteadyDuration::max();
    const SteadyTime begin = std::chrono::steady_clock::now();
    pace_.setRate(host_.points_hz, begin);
    if (!pace_.isDue(begin)) return pace_.next() - begin;
    is_outdated_ = false;
    publish(mesh->meshes.all().assemble(), mesh->stamp);
    pace_.end(begin);
    return SteadyDuration::max();
  }

 private:
  void publish(const Mesh& mesh, const ros::Time& stamp) {
    Cloud cloud;
    cloud.header.frame_id = frameOfMap(host_.params);
    cloud.header.stamp = pcl_conversions::toPCL(stamp);
    // Reserves at least one point: pcl_ros copies from the address of the points even if there are
    // none, and this address must not be null.
    cloud.reserve(std::max<size_t>(1, mesh.vertices_m.size()));
    for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
      cloud.push_back(toPoint(mesh, i, host_.params.mapper.mesh.colour));
    }
    topic_.publish(cloud);
  }

  const Host& host_;
  Topic topic_;
  std::atomic<bool> is_outdated_{false};
  Pace pace_;
};

}  // namespace

std::unique_ptr<Step> makePointsStep(const Host& host) {
  return std::make_unique<PointsStep>(host);
}

}  // namespace dtsdf
