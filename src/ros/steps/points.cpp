/// The step that publishes the vertices of the mesh as a point cloud, while someone listens.
#include <ros/console.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <atomic>
#include <cstring>

#include "dtsdf_mapping/mesh.h"
#include "ros/common/topic.h"
#include "ros/steps/make_steps.h"

namespace dtsdf {
namespace {

sensor_msgs::PointCloud2 cloudOf(const Mesh& mesh, MeshColour colour) {
  sensor_msgs::PointCloud2 cloud;
  cloud.height = 1;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(7, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "normal_x", 1,
                                kFloat, "normal_y", 1, kFloat, "normal_z", 1, kFloat, "rgb", 1,
                                kFloat);
  modifier.resize(mesh.vertices_m.size());
  sensor_msgs::PointCloud2Iterator<float> next(cloud, "x");
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i, ++next) {
    const std::array<double, 3> p_W = positionInMap(mesh, i);
    for (size_t axis = 0; axis < 3; ++axis) next[axis] = static_cast<float>(p_W[axis]);
    std::memcpy(&next[3], &mesh.normals[i], 3 * sizeof(float));
    const std::array<uint8_t, 3> rgb = vertexColour(colour, mesh, i);
    const uint8_t bgra[] = {rgb[2], rgb[1], rgb[0], 255};  // of a little-endian number
    std::memcpy(&next[6], bgra, sizeof(bgra));
  }
  return cloud;
}

/// `surface_points`: a cloud is the whole mesh.
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
    mesh->meshes.dropFetched();
    const SteadyTime end = std::chrono::steady_clock::now();
    pace_.beginInStep(begin);
    pace_.restUntil(end + (end - begin));
    return SteadyDuration::max();
  }

  void fill(dtsdf_mapping::MapStatus& status) override { status.topics.push_back(topic_.status()); }

 private:
  void publish(const Mesh& mesh, const ros::Time& stamp) {
    if (isFarFromOrigin(mesh)) {
      ROS_WARN_STREAM_ONCE_NAMED(
          "dtsdf_mapping", topic_.status().topic
                               << " has float positions, which are 0.5 mm apart 8 km from the "
                                  "origin of the map and 4 mm at 40 km; mesh_blocks and mesh have "
                                  "doubles");
    }
    sensor_msgs::PointCloud2 cloud = cloudOf(mesh, host_.params.mapper.mesh.colour);
    cloud.header.frame_id = frameOfMap(host_.params.node);
    cloud.header.stamp = stamp;
    topic_.publish(cloud);
  }

  const Host& host_;
  Topic topic_;
  std::atomic<bool> is_outdated_{false};  ///< The cloud that was published last.
  Pace pace_;
};

}  // namespace

std::unique_ptr<Step> makePointsStep(const Host& host) {
  return std::make_unique<PointsStep>(host);
}

}  // namespace dtsdf
