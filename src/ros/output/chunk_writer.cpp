#include "ros/output/chunk_writer.h"

#include <dtsdf_mapping/MeshBlocks.h>
#include <ros/serialization.h>
#include <visualization_msgs/MarkerArray.h>

#include <utility>
#include <vector>

#include "ros/common/chunk_message.h"
#include "ros/output/listener_topic.h"

namespace dtsdf {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

constexpr char kNamespace[] = "mesh";
constexpr size_t kBytesOfPoint = 3 * sizeof(double) + 4 * sizeof(float);
constexpr size_t kBytesOfMarker = 200;

std_msgs::ColorRGBA toColour(const std::array<uint8_t, 3>& rgb) {
  std_msgs::ColorRGBA colour;
  colour.r = static_cast<float>(rgb[0]) / 255.0f;
  colour.g = static_cast<float>(rgb[1]) / 255.0f;
  colour.b = static_cast<float>(rgb[2]) / 255.0f;
  colour.a = 1.0f;
  return colour;
}

geometry_msgs::Point toPoint(const std::array<double, 3>& p_W) {
  geometry_msgs::Point point;
  point.x = p_W[0];
  point.y = p_W[1];
  point.z = p_W[2];
  return point;
}

class MarkerWriter : public ChunkWriter {
 public:
  MarkerWriter(std::string map_frame, MeshColour colour)
      : map_frame_(std::move(map_frame)), colour_(colour) {}

  ros::AdvertiseOptions advertiseOptions() const override { return topicOf<MarkerArray>("mesh"); }

  void begin(bool anew, double step_m, const ros::Time&) override {
    message_ = MarkerArray();
    step_m_ = step_m;
    bytes_ = 0;
    // Removes every marker of the mesh, also those of a node that ran before under the same name.
    if (anew) addMarker(0, Marker::DELETEALL);
  }

  void add(PackedChunk chunk, int id) override {
    if (chunk.triangleCount() == 0) {
      addMarker(id, Marker::DELETE);
    } else {
      fill(chunk, addMarker(id, Marker::ADD));
    }
  }

  size_t bytes() const override { return bytes_; }

  ros::SerializedMessage finish() override {
    return ros::serialization::serializeMessage(message_);
  }

 private:
  Marker& addMarker(int id, int action) {
    Marker& marker = message_.markers.emplace_back();
    marker.header.frame_id = map_frame_;  // stamp 0: shown with the newest transforms of the viewer
    marker.ns = kNamespace;
    marker.id = id;
    marker.action = action;
    marker.pose.orientation.w = 1.0;
    bytes_ += kBytesOfMarker;
    return marker;
  }

  void fill(const PackedChunk& chunk, Marker& marker) {
    const Mesh mesh = unpackChunk(chunk, step_m_);
    std::vector<geometry_msgs::Point> points;
    std::vector<std_msgs::ColorRGBA> colours;
    for (size_t i = 0; i < chunk.vertexCount(); ++i) {
      points.push_back(toPoint(positionOf(chunk, step_m_, i)));
      colours.push_back(toColour(vertexColour(colour_, mesh, i)));
    }
    marker.type = Marker::TRIANGLE_LIST;
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
    marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1.0f;
    const size_t corners = 3 * chunk.triangleCount();
    marker.points.reserve(corners);
    marker.colors.reserve(corners);
    for (size_t i = 0; i < corners; ++i) {
      marker.points.push_back(points[chunk.corner(i)]);
      marker.colors.push_back(colours[chunk.corner(i)]);
    }
    bytes_ += kBytesOfPoint * corners;
  }

  std::string map_frame_;
  double step_m_ = 0.0;  ///< Of the message that was begun.
  MeshColour colour_;
  MarkerArray message_;
  size_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<ChunkWriter> makeMarkerWriter(const std::string& map_frame, MeshColour colour) {
  return std::make_unique<MarkerWriter>(map_frame, colour);
}

namespace {

using dtsdf_mapping::MeshBlocks;

class BlockWriter : public ChunkWriter {
 public:
  explicit BlockWriter(std::string map_frame) : map_frame_(std::move(map_frame)) {}

  ros::AdvertiseOptions advertiseOptions() const override {
    return topicOf<MeshBlocks>("mesh_blocks");
  }

  void begin(bool anew, double step_m, const ros::Time& stamp) override {
    message_ = MeshBlocks();
    message_.header.frame_id = map_frame_;
    message_.header.stamp = stamp;
    message_.begins_anew = anew;
    message_.step_m = step_m;
    bytes_ = ros::serialization::serializationLength(message_);
  }

  void add(PackedChunk chunk, int) override {
    bytes_ += bytesInMessage(chunk);
    message_.blocks.push_back(toMessage(std::move(chunk)));
  }

  size_t bytes() const override { return bytes_; }

  ros::SerializedMessage finish() override {
    return ros::serialization::serializeMessage(message_);
  }

 private:
  std::string map_frame_;
  MeshBlocks message_;
  size_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<ChunkWriter> makeBlockWriter(const std::string& map_frame) {
  return std::make_unique<BlockWriter>(map_frame);
}

}  // namespace dtsdf
