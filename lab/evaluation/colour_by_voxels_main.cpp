/// colour_by_voxels: colours a mesh as undirected maps do, to compare with.

#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "dtsdf_mapping/geometry.h"
#include "dtsdf_mapping/io/recording.h"
#include "evaluation/camera_views.h"
#include "evaluation/triangle_mesh.h"
#include "program/command_line.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct ColourByVoxelsOptions {
  std::string folder, mesh_path, coloured_path;
  double voxel_size_m = 0.02;
  double truncation_voxels = 4.0;
};

ColourByVoxelsOptions readOptions(const std::vector<std::string>& arguments) {
  ColourByVoxelsOptions options;
  CommandLine line("colour_by_voxels", "FOLDER MESH.ply OUT.ply [options]",
                   "Colours a mesh by the mean of what falls on its voxels: each pixel's colour "
                   "goes to the voxels along its ray up to the truncation distance before and "
                   "behind its depth, weighted by 1 / z^2, and a vertex gets that of the nearest "
                   "voxel. The TUM folder needs a registered colour image for each depth image.");
  line.addText({"FOLDER", "", "the TUM folder"}, options.folder);
  line.addText({"MESH.ply", "", "the mesh"}, options.mesh_path);
  line.addText({"OUT.ply", "", "the coloured mesh"}, options.coloured_path);
  line.addNumber({"--voxel-size", "METRES", "edge of a voxel"}, options.voxel_size_m, {0.001, 1.0});
  line.addNumber({"--truncation", "VOXELS", "truncation distance"}, options.truncation_voxels,
                 {0.0, 100.0});
  line.parse(arguments);
  return options;
}

/// Weighted means of colours by voxel.
class ColourGrid {
 public:
  explicit ColourGrid(double voxel_size_m) : voxel_size_m_(voxel_size_m) {}

  void add(const Eigen::Vector3d& p_W, const Eigen::Vector3d& colour, double weight) {
    Sum& sum = sums_[keyOf(p_W)];
    sum.colour += weight * colour;
    sum.weight += weight;
  }

  /// Grey where nothing fell.
  std::array<uint8_t, 3> at(const Eigen::Vector3d& p_W) const {
    const auto it = sums_.find(keyOf(p_W));
    if (it == sums_.end()) return {127, 127, 127};
    const Eigen::Vector3d mean = it->second.colour / it->second.weight;
    return {static_cast<uint8_t>(std::lround(mean[0])), static_cast<uint8_t>(std::lround(mean[1])),
            static_cast<uint8_t>(std::lround(mean[2]))};
  }

 private:
  struct Sum {
    Eigen::Vector3d colour = Eigen::Vector3d::Zero();
    double weight = 0.0;
  };

  PackedKey keyOf(const Eigen::Vector3d& p_W) const {
    const auto bits = [&](int axis) {
      return static_cast<PackedKey>(std::lround(p_W[axis] / voxel_size_m_)) & ((1u << 21) - 1);
    };
    return bits(2) << 42 | bits(1) << 21 | bits(0);
  }

  double voxel_size_m_;
  std::unordered_map<PackedKey, Sum> sums_;
};

/// Every voxel that a ray crosses within the truncation distance, once.
void addRay(const Eigen::Vector3d& p_C, const Eigen::Isometry3d& T_W_C,
            const Eigen::Vector3d& colour, const ColourByVoxelsOptions& options, ColourGrid& grid) {
  const double length_m = p_C.norm();
  const double weight = 1.0 / (p_C.z() * p_C.z());
  const int steps = static_cast<int>(options.truncation_voxels);
  for (int step = -steps; step <= steps; ++step) {
    const double scale = 1.0 + step * options.voxel_size_m / length_m;
    grid.add(T_W_C * (scale * p_C), colour, weight);
  }
}

void colourByVoxels(const ColourByVoxelsOptions& options) {
  const Views views = readViews(options.folder);
  RecordingOptions recording;
  recording.path = options.folder;
  recording.format = "tum";
  const std::unique_ptr<ColourSource> colours = openRecordingColours(recording);
  ColourGrid grid(options.voxel_size_m);
  const ViewCamera& camera = views.camera;
  for (size_t i = 0; i < views.depth_paths.size(); ++i) {
    const std::vector<float> depth_m = readTumDepth(views.depth_paths[i], camera);
    const auto source = colours == nullptr ? std::nullopt : colours->next();
    if (!source) {
      throw std::runtime_error(options.folder + ": not every depth image has a colour image");
    }
    const ColourFrame& image = source->colour;
    if (image.width != camera.width || image.height != camera.height) {
      throw std::runtime_error(options.folder + ": colour image " + std::to_string(source->index) +
                               " has another size than the depth images");
    }
    for (size_t pixel = 0; pixel < depth_m.size(); ++pixel) {
      if (!(depth_m[pixel] > 0.0f)) continue;
      const auto u = static_cast<float>(pixel % static_cast<size_t>(camera.width));
      const auto v = static_cast<float>(pixel / static_cast<size_t>(camera.width));
      const Eigen::Vector3f p_C = depth_m[pixel] * rayOf(camera.intrinsics, u, v);
      const uint8_t* rgb = static_cast<const uint8_t*>(image.data) + 3 * pixel;
      addRay(p_C.cast<double>(), views.poses_W_C[i], Eigen::Vector3d(rgb[0], rgb[1], rgb[2]),
             options, grid);
    }
  }
  TriangleMesh mesh = readPly(options.mesh_path);
  mesh.colours.clear();
  for (const Eigen::Vector3f& p : mesh.vertices) mesh.colours.push_back(grid.at(p.cast<double>()));
  writePly(options.coloured_path, mesh);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("colour_by_voxels", argc, argv, dtsdf::readOptions,
                           dtsdf::colourByVoxels);
}
