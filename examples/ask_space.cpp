// Maps a wall with a box before it, and asks whether a robot may stand in some places: ask_space
#include <dtsdf_mapping/mapper.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <vector>

/// Depth in metres of a wall 2 m ahead, and of a box of half a metre that begins 1.2 m ahead.
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

/// How far a cube about a point is from the nearest surface, at the least; -1 where it is not known
/// whether a robot of that size may stand there. All of it is asked for, each cell of it at least
/// once: between its corners there may be a surface, or something that nothing is known of.
double clearanceAt(const dtsdf::Space& space, const Eigen::Vector3d& middle_W, double side_m) {
  const int steps = static_cast<int>(std::ceil(2.0 * side_m / space.cellSize_m()));
  const double step_m = side_m / steps;
  double least_m = std::numeric_limits<double>::infinity();
  for (int z = 0; z <= steps; ++z) {
    for (int y = 0; y <= steps; ++y) {
      for (int x = 0; x <= steps; ++x) {
        const Eigen::Vector3d from_corner_m = step_m * Eigen::Vector3d(x, y, z);
        const dtsdf::SpaceDistance distance =
            space.distanceAt(middle_W + from_corner_m - Eigen::Vector3d::Constant(side_m / 2.0));
        if (!distance.known) return -1.0;  // unknown is not free
        least_m = std::min(least_m, static_cast<double>(distance.distance_m));
      }
    }
  }
  // Half a diagonal between the points that were asked for, and the error of distances.
  return std::max(0.0, least_m - std::sqrt(3.0) / 2.0 * step_m - 1.5 * space.cellSize_m());
}

int main() try {
  dtsdf::DepthFrame frame;  // the camera looks along z of the map, x right and y down
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
  mapper->updateMesh();  // surfaces are those of the mesh

  dtsdf::Space& space = *mapper->space();
  space.updateDistances();
  const auto stand = [&](double x, double z) {
    const double clearance_m = clearanceAt(space, {x, 0.0, z}, 0.3);
    std::cout << "at x = " << x << " m, z = " << z << " m: ";
    if (clearance_m < 0.0) {
      std::cout << "not known to be free\n";
    } else {
      std::cout << "clearance " << clearance_m << " m\n";
    }
    return clearance_m;
  };
  const double before_wall = stand(-0.4, 1.4), in_box = stand(0.3, 1.4), behind = stand(0.0, 2.4);
  const bool is_right = before_wall > 0.05 && in_box <= 0.0 && behind < 0.0;
  return is_right ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << "ask_space: " << error.what() << "\n";
  return 1;
}
