/// The step that publishes the vertices of the mesh as a point cloud, while someone listens.
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <atomic>
#include <cstring>

#include "dtsdf_mapping/mesh.h"
#include "ros/common/topic.h"
#include "ros/steps/make_steps.h"

namespace dtsdf {
namespace {

/// Publishes `surface_points`; each cloud holds the whole mesh.
class PointsStep : public Step {
 public:
  explicit PointsStep(const Host& host) : host_(host), pace_(host.rates.points_hz) {}

  void advertise(const Handles& handles) override {
    topic_.advertise<sensor_msgs::PointCloud2>(handles.prompt, "surface_points", 1,
                                               [this](const auto&) { is_outdated_ = true; });
  }

  std::optional<double> meshRate_hz() const override {
    return topic_.isFollowed() ? std::optional<double>(host_.rates.points_hz) : std::nullopt;
  }

  void changed(const MeshChanges&) override { is_outdated_ = true; }
  SteadyDuration publish(ShownMesh* mesh) override {
    if (mesh == nullptr || !is_outdated_ || !topic_.isFollowed()) return SteadyDuration::max();
    const SteadyTime begin = std::chrono::steady_clock::now();
    pace_.setRate(host_.rates.points_hz, begin);
    if (!pace_.isDue(begin)) return pace_.next() - begin;
    is_outdated_ = false;
    publish(mesh->meshes.all().assemble(), mesh->stamp);
    pace_.end(begin);
    return SteadyDuration::max();
  }

  void fill(dtsdf_mapping::MapStatus& status) override { status.topics.push_back(topic_.status()); }

 private:
  void publish(const Mesh& mesh, const ros::Time& stamp) {
    sensor_msgs::PointCloud2 cloud;
    cloud.header.frame_id = frameOfMap(host_.params);
    cloud.header.stamp = stamp;
    cloud.height = 1;
    cloud.is_dense = true;
    constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
    sensor_msgs::PointCloud2Modifier modifier(cloud);
    modifier.setPointCloud2Fields(8, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "normal_x", 1,
                                  kFloat, "normal_y", 1, kFloat, "normal_z", 1, kFloat, "rgb", 1,
                                  kFloat, "curvature", 1, kFloat);
    modifier.resize(mesh.vertices_m.size());
    uint8_t* point = cloud.data.data();
    for (size_t i = 0; i < mesh.vertices_m.size(); ++i, point += cloud.point_step) {
      const auto [x, y, z] = positionInMap(mesh, i);
      const Eigen::Vector3f p = Eigen::Vector3d(x, y, z).cast<float>();
      const Vec3f& n = mesh.normals[i];
      const auto [red, green, blue] = vertexColour(host_.params.mapper.mesh.colour, mesh, i);
      const float numbers[] = {p.x(), p.y(), p.z(), n.x, n.y, n.z};
      const uint8_t rgb[] = {blue, green, red, 255};
      std::memcpy(point, numbers, sizeof(numbers));
      std::memcpy(point + sizeof(numbers), rgb, sizeof(rgb));
    }
    topic_.publish(cloud);
  }

  const Host& host_;
  Topic topic_;
  std::atomic<bool> is_outdated_{false};  ///< Whether the last cloud is outdated.
  Pace pace_;
};

}  // namespace

std::unique_ptr<Step> makePointsStep(const Host& host) {
  return std::make_unique<PointsStep>(host);
}

}  // namespace dtsdf
