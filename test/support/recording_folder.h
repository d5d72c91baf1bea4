/// Writes small recordings in the layouts of published data sets.
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/recording.h"
#include "support/temporary_folder.h"

namespace dtsdf {

/// A pose with a 90 degree rotation about z and the translation (x, -2, 3), as a 4 x 4 matrix.
inline std::string poseMatrix(double x) {
  return "0 -1 0 " + std::to_string(x) + "\n1 0 0 -2\n0 0 1 3\n0 0 0 1\n";
}

/// Returns poseMatrix() as a single line.
inline std::string poseLine(double x) {
  return "0 -1 0 " + std::to_string(x) + " 1 0 0 -2 0 0 1 3 0 0 0 1\n";
}

/// Writes a depth image in which all pixels in row v have the value (v + 1) * step.
inline void writeDepthImage(const std::string& path, int width, int height, int step) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  cv::Mat image(height, width, CV_16UC1);
  for (int v = 0; v < height; ++v) image.row(v).setTo(step * (v + 1));
  cv::imwrite(path, image);
}

/// Writes a colour image. Red is (v + 1) * step in row v, green is 0 and blue is 200.
inline void writeColourRows(const std::string& path, int width, int height, int step) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  cv::Mat image(height, width, CV_8UC3);
  for (int v = 0; v < height; ++v) image.row(v).setTo(cv::Scalar(200, 0, step * (v + 1)));
  cv::imwrite(path, image);
}

inline std::vector<SourceColour> readAllColours(const RecordingOptions& options) {
  std::vector<SourceColour> images;
  const auto source = openRecordingColours(options);
  if (source == nullptr) return images;
  while (auto image = source->next()) images.push_back(std::move(*image));
  return images;
}

/// The red value of the first pixel in row `v`.
inline int redAt(const ColourFrame& image, int v) {
  return static_cast<const uint8_t*>(image.data)[static_cast<size_t>(v) * image.row_bytes];
}

inline std::vector<SourceFrame> readAll(FrameSource& source) {
  std::vector<SourceFrame> frames;
  while (auto frame = source.next()) frames.push_back(std::move(*frame));
  return frames;
}

/// The value of a pixel in a 16-bit frame.
inline int rawAt(const DepthFrame& frame, int u, int v) {
  const auto* row = static_cast<const char*>(frame.data) + static_cast<size_t>(v) * frame.row_bytes;
  return reinterpret_cast<const uint16_t*>(row)[u];
}

/// The point measured by a pixel, in W.
inline Eigen::Vector3d pointOf(const DepthFrame& frame, int u, int v) {
  const Intrinsics& K = frame.intrinsics;
  const float z_m = static_cast<float>(rawAt(frame, u, v)) * frame.unit_m;
  const Eigen::Vector3f p_C((static_cast<float>(u) - K.cx) * z_m / K.fx,
                            (static_cast<float>(v) - K.cy) * z_m / K.fy, z_m);
  return frame.T_W_C * p_C.cast<double>();
}

/// Reads a whole recording. Returns the text of the error thrown, or "" if nothing is thrown.
inline std::string readingErrorOf(const RecordingOptions& options) {
  return errorOf([&] {
    const auto source = openRecording(options);
    readAll(*source);
  });
}

}  // namespace dtsdf
