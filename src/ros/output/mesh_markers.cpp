#include "ros/output/mesh_markers.h"

#include <vector>

namespace dtsdf {
namespace {

constexpr char kNamespace[] = "mesh";

visualization_msgs::Marker makeMarker(const std::string& map_frame, int id, int action) {
  visualization_msgs::Marker marker;
  marker.header.frame_id = map_frame;  // stamp 0: shown with the newest transforms of the viewer
  marker.ns = kNamespace;
  marker.id = id;
  marker.action = action;
  marker.pose.orientation.w = 1.0;
  return marker;
}

std_msgs::ColorRGBA toColour(const std::array<uint8_t, 3>& rgb) {
  std_msgs::ColorRGBA colour;
  colour.r = static_cast<float>(rgb[0]) / 255.0f;
  colour.g = static_cast<float>(rgb[1]) / 255.0f;
  colour.b = static_cast<float>(rgb[2]) / 255.0f;
  colour.a = 1.0f;
  return colour;
}

}  // namespace

visualization_msgs::Marker makeMeshMarker(const Mesh& mesh, MeshColour colour,
                                          const std::string& map_frame, int id) {
  using visualization_msgs::Marker;
  if (mesh.triangles.empty()) return makeMarker(map_frame, id, Marker::DELETE);

  std::vector<std_msgs::ColorRGBA> colours;
  colours.reserve(mesh.vertices_m.size());
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    colours.push_back(toColour(vertexColour(colour, mesh, i)));
  }

  Marker marker = makeMarker(map_frame, id, Marker::ADD);
  marker.type = Marker::TRIANGLE_LIST;
  marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
  marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1.0f;
  marker.points.reserve(3 * mesh.triangles.size());
  marker.colors.reserve(3 * mesh.triangles.size());
  for (const std::array<uint32_t, 3>& triangle : mesh.triangles) {
    for (const uint32_t i : triangle) {
      geometry_msgs::Point point;
      point.x = mesh.vertices_m[i].x;
      point.y = mesh.vertices_m[i].y;
      point.z = mesh.vertices_m[i].z;
      marker.points.push_back(point);
      marker.colors.push_back(colours[i]);
    }
  }
  return marker;
}

visualization_msgs::Marker makeDeleteAllMarker(const std::string& map_frame) {
  return makeMarker(map_frame, 0, visualization_msgs::Marker::DELETEALL);
}

}  // namespace dtsdf
