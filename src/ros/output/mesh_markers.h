/// Markers that show a mesh in RViz.
#pragma once

#include <visualization_msgs/Marker.h>

#include <string>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// A TRIANGLE_LIST with a colour per vertex; a DELETE of the id if the mesh has no triangles.
visualization_msgs::Marker makeMeshMarker(const Mesh& mesh, MeshColour colour,
                                          const std::string& map_frame, int id);

/// Removes every mesh marker, also of a node that ran before under the same name.
visualization_msgs::Marker makeDeleteAllMarker(const std::string& map_frame);

}  // namespace dtsdf
