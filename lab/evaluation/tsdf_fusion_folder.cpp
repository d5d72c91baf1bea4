#include "evaluation/tsdf_fusion_folder.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <stdexcept>

#include "dtsdf_mapping/pinhole.h"
#include "io/matrix_file.h"

namespace dtsdf {

namespace {

namespace fs = std::filesystem;

const std::string kDepthEnding = ".depth.png";

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::vector<std::string> depthPaths(const std::string& folder) {
  std::vector<std::string> paths;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (endsWith(entry.path().string(), kDepthEnding)) paths.push_back(entry.path().string());
    }
  }
  if (paths.empty()) throw std::runtime_error(folder + ": no frame-NUMBER.depth.png there");
  std::sort(paths.begin(), paths.end());  // the numbers have leading zeros
  return paths;
}

/// The pose, or nothing for a lost camera.
std::optional<Eigen::Isometry3d> readPose(const std::string& path) {
  return rigidMotion(readMatrixFile(path, 4, 4, "each depth image has a pose file beside it"));
}

cv::Mat readGrey16(const std::string& path) {
  cv::Mat image = cv::imread(path, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_16UC1) throw std::runtime_error(path + ": not a 16-bit grey image");
  return image;
}

}  // namespace

TsdfFusionFolder readTsdfFusionFolder(const std::string& folder) {
  TsdfFusionFolder found;
  for (const std::string& path : depthPaths(folder)) {
    const std::string stem = path.substr(0, path.size() - kDepthEnding.size());
    if (const auto T_W_C = readPose(stem + ".pose.txt")) {
      found.frames.push_back({path, *T_W_C});
    } else {
      ++found.without_pose;
    }
  }
  if (found.frames.empty()) throw std::runtime_error(folder + ": no frame has a pose");
  return found;
}

ViewCamera cameraForImage(const std::string& depth_path, const Intrinsics& intrinsics) {
  const cv::Mat image = readGrey16(depth_path);
  return {intrinsics, image.cols, image.rows};
}

std::vector<float> readMillimetres(const std::string& depth_path, const ViewCamera& camera) {
  const cv::Mat image = readGrey16(depth_path);
  if (image.cols != camera.width || image.rows != camera.height) {
    throw std::runtime_error(depth_path + ": not of the size of the first image");
  }
  std::vector<float> depth_m;
  depth_m.reserve(image.total());
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const uint16_t raw = image.at<uint16_t>(v, u);
      depth_m.push_back(raw == kNoDepth16 ? 0.0f : 0.001f * static_cast<float>(raw));
    }
  }
  return depth_m;
}

}  // namespace dtsdf
