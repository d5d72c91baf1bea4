/// Writes images of an analytic scene to a TUM folder, as input for `reconstruct`.
#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "simulation/scene.h"
#include "support/temporary_folder.h"  // writeBytes()

namespace dtsdf {

inline void writeCameraInfo(const std::filesystem::path& file, const Intrinsics& K, int width,
                            int height) {
  std::ostringstream camera;
  camera << "image_width: " << width << "\nimage_height: " << height
         << "\nprojection_matrix:\n  data: [" << K.fx << ", 0, " << K.cx << ", 0, 0, " << K.fy
         << ", " << K.cy << ", 0, 0, 0, 1, 0]\n";
  writeBytes(file.string(), camera.str());
}

/// Writes one depth image every 0.1 s. Depths are in units of 0.2 mm, and the horizontal field of
/// view is 65 degrees.
/// The trajectory file contains the poses T_W_C[i], or moved(i, T_W_C[i]) if `moved` is set.
inline void writeSceneRecording(
    const std::filesystem::path& folder, const Scene& scene,
    const std::vector<Eigen::Isometry3d>& T_W_C, int width = 160, int height = 120,
    const std::function<Eigen::Isometry3d(size_t, const Eigen::Isometry3d&)>& moved = nullptr) {
  const float focal_px = 0.785f * static_cast<float>(width);
  const Intrinsics K{focal_px, focal_px, 0.5f * static_cast<float>(width - 1),
                     0.5f * static_cast<float>(height - 1)};
  std::ostringstream depth, poses;
  depth.precision(12);
  poses.precision(12);
  std::filesystem::create_directories(folder / "depth");
  for (size_t i = 0; i < T_W_C.size(); ++i) {
    const std::string file = "depth/" + std::to_string(i) + ".png";
    const std::vector<float> depth_m = renderDepth(scene, K, width, height, T_W_C[i]);
    cv::Mat image(height, width, CV_16UC1);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        image.at<uint16_t>(v, u) =
            static_cast<uint16_t>(5000.0f * depth_m[static_cast<size_t>(v) * width + u] + 0.5f);
      }
    }
    cv::imwrite((folder / file).string(), image);
    const Eigen::Isometry3d written = moved ? moved(i, T_W_C[i]) : T_W_C[i];
    const Eigen::Vector3d t = written.translation();
    const Eigen::Quaterniond q(written.linear());
    const double stamp_s = 100.0 + 0.1 * static_cast<double>(i);
    depth << stamp_s << " " << file << "\n";
    poses << stamp_s << " " << t.x() << " " << t.y() << " " << t.z() << " " << q.x() << " " << q.y()
          << " " << q.z() << " " << q.w() << "\n";
  }
  writeBytes((folder / "depth.txt").string(), depth.str());
  writeBytes((folder / "groundtruth.txt").string(), poses.str());
  writeCameraInfo(folder / "camera_info.yaml", K, width, height);
}

}  // namespace dtsdf
