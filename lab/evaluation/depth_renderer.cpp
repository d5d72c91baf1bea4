#include "evaluation/depth_renderer.h"

#include <cmath>
#include <filesystem>

#include "io/atomic_file.h"
#include "io/camera_file.h"
#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "io/trajectory.h"

namespace dtsdf {

constexpr float kTumUnitsPerMetre = 5000.0f;

DepthView renderView(const MeshScene& scene, const ViewCamera& camera,
                     const Eigen::Isometry3d& T_W_C) {
  DepthView view{std::vector<float>(camera.pixelCount(), 0.0f),
                 std::vector<float>(camera.pixelCount(), 0.0f)};
  const Eigen::Matrix3f R_W_C = T_W_C.linear().cast<float>();
  const Eigen::Vector3f origin_W = T_W_C.translation().cast<float>();
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      // The direction has z = 1 in the optical frame, so the ray parameter at the hit is the depth.
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
                     const std::vector<Eigen::Isometry3d>& poses_W_C, double rate_hz,
                     const std::vector<Eigen::Isometry3d>& colour_poses_W_C)
    : directory_(directory),
      camera_(camera),
      poses_W_C_(poses_W_C),
      period_s_(1.0 / rate_hz),
      colour_poses_W_C_(colour_poses_W_C) {
  std::filesystem::create_directories(directory_ + "/depth");
  if (!colour_poses_W_C.empty()) std::filesystem::create_directories(directory_ + "/rgb");
}

double TumWriter::stampOf(double index) const { return 1600000000.0 + period_s_ * index; }

void TumWriter::writeColours(size_t index, const std::vector<Rgb8>& colours) const {
  RgbImage image{camera_.width, camera_.height, {}};
  for (const Rgb8& colour : colours) {
    image.values.insert(image.values.end(), colour.begin(), colour.end());
  }
  const double stamp_s = stampOf(static_cast<double>(index) + 0.5);
  writeFileAtomically(directory_ + "/rgb/" + stampOfList(stamp_s) + ".png", encodeColourPng(image));
}

void TumWriter::write(size_t index, const std::vector<uint16_t>& depth) const {
  const double stamp_s = stampOf(static_cast<double>(index));
  writeFileAtomically(directory_ + "/depth/" + stampOfList(stamp_s) + ".png",
                      encodeDepthPng({camera_.width, camera_.height, depth}));
}

void TumWriter::finish(const std::string& camera_name) const {
  std::vector<StampedPose> poses;
  const auto list = [&](const std::string& kind, const std::vector<Eigen::Isometry3d>& poses_W_C,
                        double first) {
    std::string lines = "# timestamp filename\n";
    for (size_t i = 0; i < poses_W_C.size(); ++i) {
      poses.push_back({stampOf(static_cast<double>(i) + first), poses_W_C[i]});
      const std::string stamp = stampOfList(poses.back().stamp_s);
      lines += stamp + " " + kind + "/" + stamp + ".png\n";
    }
    if (!poses_W_C.empty()) writeFileAtomically(directory_ + "/" + kind + ".txt", lines);
  };
  list("depth", poses_W_C_, 0.0);
  list("rgb", colour_poses_W_C_, 0.5);
  saveTrajectory(poses, directory_ + "/groundtruth.txt");
  writeFileAtomically(
      directory_ + "/camera_info.yaml",
      cameraInfoText({camera_.width, camera_.height, camera_.intrinsics}, camera_name));
}

}  // namespace dtsdf
