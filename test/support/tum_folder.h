/// Writes a small TUM folder for tests.
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "support/temporary_folder.h"

namespace dtsdf {

constexpr int kTumWidth = 8, kTumHeight = 6;

/// Writes `count` images, one every 0.1 s, starting at stamp 100. Image i contains a wall at 0.2 (i
/// + 1) m, stored as 1000 (i + 1), and its camera is at x = i.
inline void writeTumFolder(const TemporaryFolder& folder, int count, int width = kTumWidth,
                           int height = kTumHeight) {
  std::string depth = "# stamp file\n", poses = "# stamp tx ty tz qx qy qz qw\n";
  std::filesystem::create_directories(folder / "depth");
  for (int i = 0; i < count; ++i) {
    const std::string stamp = std::to_string(100.0 + 0.1 * i);
    const std::string file = "depth/" + std::to_string(i) + ".png";
    depth += stamp + " " + file + "\n";
    poses += stamp + " " + std::to_string(i) + " 0 0 0 0 0 1\n";
    const cv::Mat image(height, width, CV_16UC1, cv::Scalar(1000 * (i + 1)));
    cv::imwrite(folder / file, image);
  }
  writeBytes(folder / "depth.txt", depth);
  writeBytes(folder / "groundtruth.txt", poses);
  const std::string cx = std::to_string(0.5 * (width - 1)), cy = std::to_string(0.5 * (height - 1));
  writeBytes(folder / "camera_info.yaml", "image_width: " + std::to_string(width) +
                                              "\nimage_height: " + std::to_string(height) +
                                              "\nprojection_matrix:\n  data: [10, 0, " + cx +
                                              ", 0, 0, 11, " + cy + ", 0, 0, 0, 1, 0]\n");
}

}  // namespace dtsdf
