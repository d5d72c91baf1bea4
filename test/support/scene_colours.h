/// Adds colour images to a recording of an analytic scene.
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "support/colour_frames.h"
#include "support/scene_recording.h"

namespace dtsdf {

/// Writes colour images with the same field of view as the depth images of writeSceneRecording().
/// There is one for every `every`-th depth image, stamped 10 ms later.
inline void writeSceneColours(const std::filesystem::path& folder, const Scene& scene,
                              const SurfaceColour& colour,
                              const std::vector<Eigen::Isometry3d>& T_W_C, int width, int height,
                              size_t every = 1) {
  std::ostringstream list;
  list.precision(12);
  std::filesystem::create_directories(folder / "rgb");
  Intrinsics K{};
  for (size_t i = 0; i < T_W_C.size(); i += every) {
    PaintedFrame frame = renderColour(scene, colour, T_W_C[i], width, height);
    K = frame.frame.intrinsics;
    for (size_t at = 0; at + 2 < frame.pixels.size(); at += 3) {
      std::swap(frame.pixels[at], frame.pixels[at + 2]);  // OpenCV's channel order
    }
    const std::string file = "rgb/" + std::to_string(i) + ".png";
    cv::imwrite((folder / file).string(), cv::Mat(height, width, CV_8UC3, frame.pixels.data()));
    list << 100.01 + 0.1 * static_cast<double>(i) << " " << file << "\n";
  }
  writeBytes((folder / "rgb.txt").string(), list.str());
  writeCameraInfo(folder / "colour_info.yaml", K, width, height);
}

}  // namespace dtsdf
