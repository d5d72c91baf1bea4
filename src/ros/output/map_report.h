/// What is told about the map while the node runs.
#pragma once

#include <cstddef>
#include <string>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// What the status tells about the map.
struct MapReport {
  std::string backend;
  std::string failure;  ///< Of the backend; empty while it works.
  MapStats stats;
  size_t triangles = 0;
  double integrate_ms = 0.0, mesh_ms = 0.0, publish_ms = 0.0;
};

}  // namespace dtsdf
