// Maps a wall with a box in front of it, and prints the distance to the nearest surface at a few
// points: 03_distances
#include <dtsdf_mapping/mapper.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <vector>

/// Depth in metres of a wall at 2 m and of a square face of a box, 0.5 m wide, at 1.2 m.
std::vector<float> renderBoxAndWall(const dtsdf::DepthFrame& frame) {
  std::vector<float> depth_m;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      const double x = (u - frame.intrinsics.cx) / frame.intrinsics.fx;
      const double y = (v - frame.intrinsics.cy) / frame.intrinsics.fy;
      const bool is_box = std::abs(x * 1.2 - 0.3) < 0.25 && std::abs(y * 1.2) < 0.25;
      depth_m.push_back(is_box ? 1.2f : 2.0f);
    }
  }
  return depth_m;
}

int main() try {
  dtsdf::DepthFrame frame;  // the camera looks along z of the map frame; x is right, y is down
  frame.width = 320;
  frame.height = 240;
  frame.row_bytes = frame.width * sizeof(float);
  frame.encoding = dtsdf::DepthEncoding::kFloat32;
  frame.unit_m = 1.0f;
  frame.intrinsics = {260.0f, 260.0f, 159.5f, 119.5f};
  const std::vector<float> depth_m = renderBoxAndWall(frame);
  frame.data = depth_m.data();

  dtsdf::MapperParams params;
  params.space.enabled = true;
  const auto mapper = dtsdf::makeMapper(params);
  for (int i = 0; i < 3; ++i) {
    const dtsdf::IntegrationResult result = mapper->integrate(frame);
    if (result.status != dtsdf::FrameStatus::kFused) std::cerr << result.message << "\n";
  }
  mapper->updateMesh();  // distances are measured to the mesh

  dtsdf::Space& space = *mapper->space();
  space.updateDistances();
  const auto distanceAt = [&](double x, double z) {
    const dtsdf::SpaceDistance found = space.distanceAt({x, 0.0, z});
    std::cout << "at x = " << x << " m, z = " << z << " m: ";
    if (!found.known) {
      std::cout << "not known to be free\n";  // treat it as occupied
      return -1.0;
    }
    // Distances may be too large by up to 1.5 cells.
    const double least_m = std::max(0.0, found.distance_m - 1.5 * space.cellSize_m());
    std::cout << "at least " << least_m << " m to the nearest surface\n";
    return least_m;
  };
  const double before_wall = distanceAt(-0.4, 1.4), at_box = distanceAt(0.3, 1.2);
  const double behind = distanceAt(0.0, 2.4);
  const bool is_right = before_wall > 0.1 && at_box <= 0.0 && behind < 0.0;
  return is_right ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << "03_distances: " << error.what() << "\n";
  return 1;
}
