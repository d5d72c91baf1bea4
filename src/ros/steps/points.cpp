/// The step that publishes the vertices of the mesh as a point cloud, while someone listens.
#include <ros/console.h>
#include <sensor_msgs/PointCloud2.h>

#include <atomic>
#include <cstring>
#include <utility>

#include "dtsdf_mapping/mesh.h"
#include "ros/common/topic.h"
#include "ros/steps/make_steps.h"

namespace dtsdf {
namespace {

/// As PCL's PointXYZRGBNormal lies in memory.
struct Point {
  float x, y, z, one = 1.0f;
  Vec3f normal;
  float zero = 0.0f;
  uint8_t blue, green, red, alpha = 255;
  float curvature = 0.0f, unused[2] = {};
};
static_assert(sizeof(Point) == 48, "as PCL has it");

Point toPoint(const Mesh& mesh, size_t vertex, MeshColour colour) {
  const std::array<double, 3> p_W = positionInMap(mesh, vertex);
  const auto [red, green, blue] = vertexColour(colour, mesh, vertex);
  Point point;
  point.x = static_cast<float>(p_W[0]);
  point.y = static_cast<float>(p_W[1]);
  point.z = static_cast<float>(p_W[2]);
  point.normal = mesh.normals[vertex];
  point.red = red;
  point.green = green;
  point.blue = blue;
  return point;
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
    sensor_msgs::PointCloud2 cloud;
    cloud.header.frame_id = frameOfMap(host_.params.node);
    cloud.header.stamp = stamp;
    constexpr std::pair<const char*, uint32_t> kFields[] = {
        {"x", 0},         {"y", 4},         {"z", 8},         {"rgb", 32},
        {"normal_x", 16}, {"normal_y", 20}, {"normal_z", 24}, {"curvature", 36}};
    for (const auto& [name, offset] : kFields) {
      cloud.fields.emplace_back();
      cloud.fields.back().name = name;
      cloud.fields.back().offset = offset;
      cloud.fields.back().datatype = sensor_msgs::PointField::FLOAT32;
      cloud.fields.back().count = 1;
    }
    cloud.height = 1;
    cloud.width = static_cast<uint32_t>(mesh.vertices_m.size());
    cloud.point_step = sizeof(Point);
    cloud.row_step = cloud.width * cloud.point_step;
    cloud.is_dense = true;
    cloud.data.resize(cloud.row_step);
    for (size_t i = 0; i < cloud.width; ++i) {
      const Point point = toPoint(mesh, i, host_.params.mapper.mesh.colour);
      std::memcpy(&cloud.data[i * sizeof(Point)], &point, sizeof(Point));
    }
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
