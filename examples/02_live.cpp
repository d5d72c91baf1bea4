// Fuses depth images one at a time, as from a live camera (here: renderings of a sphere), updates
// the mesh after each image, and finally saves it: 02_live [MESH.ply]
#include <dtsdf_mapping/io/mesh_file.h>
#include <dtsdf_mapping/mapper.h>
#include <dtsdf_mapping/mesh.h>

#include <cmath>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

/// Depth of each pixel, in metres; 0 outside the sphere (radius 0.5 m, centre 2 m ahead).
std::vector<float> renderSphere(const dtsdf::DepthFrame& frame) {
  std::vector<float> depth_m;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      const dtsdf::Intrinsics& K = frame.intrinsics;
      const Eigen::Vector3d ray((u - K.cx) / K.fx, (v - K.cy) / K.fy, 1.0);
      const double a = ray.squaredNorm(), b = 2.0, c = 2.0 * 2.0 - 0.5 * 0.5;
      const double root = b * b - a * c;  // a z^2 - 2 b z + c = 0
      depth_m.push_back(root > 0.0 ? static_cast<float>((b - std::sqrt(root)) / a) : 0.0f);
    }
  }
  return depth_m;
}

int main(int argc, char** argv) try {
  if (argc > 1 && argv[1][0] == '-') throw std::invalid_argument("usage: 02_live [MESH.ply]");
  dtsdf::DepthFrame frame;
  frame.width = 320;
  frame.height = 240;
  frame.row_bytes = frame.width * sizeof(float);
  frame.encoding = dtsdf::DepthEncoding::kFloat32;
  frame.unit_m = 1.0f;
  frame.intrinsics = {260.0f, 260.0f, 159.5f, 119.5f};
  const std::vector<float> depth_m = renderSphere(frame);
  frame.data = depth_m.data();

  dtsdf::MapperParams params;  // default settings; uses CUDA if available
  const auto mapper = dtsdf::makeMapper(params);
  dtsdf::MeshStore meshes(params.map.voxel_size_m);
  for (int i = 0; i < 12; ++i) {  // the camera circles the sphere, which is at the origin
    frame.T_W_C = Eigen::AngleAxisd(i * M_PI / 6.0, Eigen::Vector3d::UnitY()) *
                  Eigen::Translation3d(0.0, 0.0, -2.0);
    const dtsdf::IntegrationResult result = mapper->integrate(frame);
    if (result.status != dtsdf::FrameStatus::kFused) std::cerr << result.message << "\n";
    meshes.apply(mapper->updateMesh());
  }
  const std::string path = argc > 1 ? argv[1] : "sphere.ply";
  dtsdf::saveMesh(meshes.assemble(), dtsdf::MeshColour::kAuto, path);
  std::cout << path << ": " << meshes.triangleCount() << " triangles\n";
} catch (const std::exception& error) {
  std::cerr << "02_live: " << error.what() << "\n";
  return 1;
}
