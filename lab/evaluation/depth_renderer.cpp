#include "evaluation/depth_renderer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "io/atomic_file.h"
#include "io/camera_file.h"
#include "params/text.h"

namespace dtsdf {

namespace {

constexpr float kTumUnitsPerMetre = 5000.0f;
constexpr double kFirstStamp_s = 1600000000.0;

std::string stampText(double after_first_s) {
  return formatted("%.6f", kFirstStamp_s + after_first_s);
}

std::string poseText(const std::string& stamp, const Eigen::Isometry3d& T_W_C) {
  const Eigen::Vector3d& t = T_W_C.translation();
  const Eigen::Quaterniond q(T_W_C.linear());
  return stamp + formatted(" %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n", t.x(), t.y(), t.z(), q.x(),
                           q.y(), q.z(), q.w());
}

}  // namespace

DepthView renderView(const MeshScene& scene, const ViewCamera& camera,
                     const Eigen::Isometry3d& T_W_C) {
  DepthView view{std::vector<float>(camera.pixelCount(), 0.0f),
                 std::vector<float>(camera.pixelCount(), 0.0f)};
  const Eigen::Matrix3f R_W_C = T_W_C.linear().cast<float>();
  const Eigen::Vector3f origin_W = T_W_C.translation().cast<float>();
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      // A direction with z = 1 in the optical frame: its parameter at the hit is the depth.
      const Eigen::Vector3f direction_W =
          R_W_C * rayOf(camera.intrinsics, static_cast<float>(u), static_cast<float>(v));
      const auto hit = scene.intersect(origin_W, direction_W);
      if (!hit) continue;
      const size_t pixel = camera.pixelAt(u, v);
      view.depth_m[pixel] = hit->distance;
      view.incidence_cosine[pixel] = std::abs(hit->normal.dot(direction_W)) / direction_W.norm();
    }
  }
  return view;
}

std::vector<Rgb8> renderColours(const MeshScene& scene, Texture texture, const ViewCamera& camera,
                                const Eigen::Isometry3d& T_W_C) {
  constexpr Rgb8 kNothing{127, 127, 127};
  const Eigen::Matrix3f R_W_C = T_W_C.linear().cast<float>();
  const Eigen::Vector3f origin_W = T_W_C.translation().cast<float>();
  const auto seenAt = [&](float u, float v) {
    const Eigen::Vector3f direction_W = R_W_C * rayOf(camera.intrinsics, u, v);
    const auto hit = scene.intersect(origin_W, direction_W);
    if (!hit) return kNothing;
    return textureColour(texture, scene.mesh(), hit->triangle,
                         origin_W + hit->distance * direction_W);
  };
  std::vector<Rgb8> colours;
  colours.reserve(camera.pixelCount());
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      int sum[3] = {};
      for (const float dv : {-0.25f, 0.25f}) {
        for (const float du : {-0.25f, 0.25f}) {
          const Rgb8 seen = seenAt(static_cast<float>(u) + du, static_cast<float>(v) + dv);
          for (size_t i = 0; i < 3; ++i) sum[i] += seen[i];
        }
      }
      colours.push_back({static_cast<uint8_t>((sum[0] + 2) / 4),
                         static_cast<uint8_t>((sum[1] + 2) / 4),
                         static_cast<uint8_t>((sum[2] + 2) / 4)});
    }
  }
  return colours;
}

std::vector<uint16_t> toTumDepth(const std::vector<float>& depth_m) {
  std::vector<uint16_t> raw(depth_m.size());
  for (size_t i = 0; i < raw.size(); ++i) {
    const float units = std::round(depth_m[i] * kTumUnitsPerMetre);
    raw[i] = units > 0.0f && units <= 65535.0f ? static_cast<uint16_t>(units) : uint16_t{0};
  }
  return raw;
}

TumWriter::TumWriter(const std::string& directory, const ViewCamera& camera,
                     const std::vector<Eigen::Isometry3d>& poses_W_C, double rate_hz)
    : directory_(directory), camera_(camera), poses_W_C_(poses_W_C), period_s_(1.0 / rate_hz) {
  std::filesystem::create_directories(directory_ + "/depth");
}

std::string TumWriter::depthStamp(size_t index) const {
  return stampText(period_s_ * static_cast<double>(index));
}

std::string TumWriter::colourStamp(size_t index) const {
  return stampText(period_s_ * (static_cast<double>(index) + 0.5));
}

void TumWriter::addColours(const std::vector<Eigen::Isometry3d>& poses_W_C) {
  std::filesystem::create_directories(directory_ + "/rgb");
  colour_poses_W_C_ = poses_W_C;
}

void TumWriter::writeColours(size_t index, const std::vector<Rgb8>& colours) const {
  cv::Mat image(camera_.height, camera_.width, CV_8UC3);
  for (int v = 0; v < camera_.height; ++v) {
    for (int u = 0; u < camera_.width; ++u) {
      const Rgb8& colour = colours[camera_.pixelAt(u, v)];
      image.at<cv::Vec3b>(v, u) = {colour[2], colour[1], colour[0]};
    }
  }
  const std::string path = directory_ + "/rgb/" + colourStamp(index) + ".png";
  if (!cv::imwrite(path, image, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    throw std::runtime_error(path + ": cannot be written");
  }
}

void TumWriter::write(size_t index, const std::vector<uint16_t>& depth) const {
  const cv::Mat image(camera_.height, camera_.width, CV_16UC1, const_cast<uint16_t*>(depth.data()));
  const std::string path = directory_ + "/depth/" + depthStamp(index) + ".png";
  if (!cv::imwrite(path, image, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    throw std::runtime_error(path + ": cannot be written");
  }
}

void TumWriter::finish(const std::string& camera_name) const {
  std::string depth = "# timestamp filename\n";
  std::string poses =
      "# timestamp tx ty tz qx qy qz qw  (camera to world; optical frame: "
      "x right, y down, z forward)\n";
  for (size_t i = 0; i < poses_W_C_.size(); ++i) {
    depth += depthStamp(i) + " depth/" + depthStamp(i) + ".png\n";
    poses += poseText(depthStamp(i), poses_W_C_[i]);
  }
  std::string colours = "# timestamp filename\n";
  for (size_t i = 0; i < colour_poses_W_C_.size(); ++i) {
    colours += colourStamp(i) + " rgb/" + colourStamp(i) + ".png\n";
    poses += poseText(colourStamp(i), colour_poses_W_C_[i]);
  }
  writeFileAtomically(directory_ + "/depth.txt", depth);
  if (!colour_poses_W_C_.empty()) writeFileAtomically(directory_ + "/rgb.txt", colours);
  writeFileAtomically(directory_ + "/groundtruth.txt", poses);
  writeFileAtomically(
      directory_ + "/camera_info.yaml",
      cameraInfoText({camera_.width, camera_.height, camera_.intrinsics}, camera_name));
}

}  // namespace dtsdf
