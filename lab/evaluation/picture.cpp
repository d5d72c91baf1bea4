#include "evaluation/picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "simulation/scene.h"
#include "threads/parallel.h"

namespace dtsdf {

namespace {

constexpr int kSamplesPerSide = 3;  // each pixel is the mean of 3 x 3 rays
const Eigen::Vector3f kFrontColour(205.0f, 205.0f, 200.0f);
const Eigen::Vector3f kBackColour(150.0f, 85.0f, 60.0f);
const Eigen::Vector3f kBackground(255.0f, 255.0f, 255.0f);

std::vector<Eigen::Vector3f> vertexNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f a = mesh.vertices[triangle[0]];
    const Eigen::Vector3f n =
        (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a);
    for (const uint32_t corner : triangle) normals[corner] += n;  // weighted by area
  }
  for (Eigen::Vector3f& n : normals) n.normalize();
  return normals;
}

/// Computes the colours of rays.
class Shader {
 public:
  Shader(const MeshScene& scene, const PictureOptions& options)
      : scene_(scene),
        options_(options),
        coloured_(options.own_colours && !scene.mesh().colours.empty()),
        normals_(vertexNormals(scene.mesh())) {}

  Eigen::Vector3f colourAt(float u, float v) const {
    const Eigen::Vector3f direction_W =
        options_.T_W_C.linear().cast<float>() * rayOf(options_.camera.intrinsics, u, v);
    const auto hit = scene_.intersect(options_.T_W_C.translation().cast<float>(), direction_W);
    if (!hit) return kBackground;
    const bool back = hit->normal.dot(direction_W) > 0.0f;
    Eigen::Vector3f normal = normalAt(*hit);
    if (normal.dot(direction_W) > 0.0f) normal = -normal;
    return light(normal, direction_W) * (back ? kBackColour : frontColour(*hit));
  }

 private:
  template <class Value>
  Value interpolate(const RayHit& hit, const Value& a, const Value& b, const Value& c) const {
    return (1.0f - hit.barycentric.x() - hit.barycentric.y()) * a + hit.barycentric.x() * b +
           hit.barycentric.y() * c;
  }

  Eigen::Vector3f normalAt(const RayHit& hit) const {
    const auto& t = scene_.mesh().triangles[hit.triangle];
    const Eigen::Vector3f smooth =
        interpolate(hit, normals_[t[0]], normals_[t[1]], normals_[t[2]]).normalized();
    constexpr float kCreaseCosine = 0.8f;  // sharp edges are not smoothed
    return smooth.dot(hit.normal) > kCreaseCosine ? smooth : hit.normal;
  }

  Eigen::Vector3f frontColour(const RayHit& hit) const {
    if (!coloured_) return kFrontColour;
    const auto& t = scene_.mesh().triangles[hit.triangle];
    const auto colour = [&](uint32_t vertex) {
      const Colour& c = scene_.mesh().colours[vertex];
      return Eigen::Vector3f(c[0], c[1], c[2]);
    };
    return interpolate(hit, colour(t[0]), colour(t[1]), colour(t[2]));
  }

  /// Brightness under a light at the camera and another at its upper left, so that edges stand out.
  float light(const Eigen::Vector3f& normal_W, const Eigen::Vector3f& direction_W) const {
    const Eigen::Vector3f lamp_W =
        options_.T_W_C.linear().cast<float>() * Eigen::Vector3f(-0.5f, -0.7f, -0.5f).normalized();
    const float head = -normal_W.dot(direction_W.normalized());
    const float side = std::max(0.0f, normal_W.dot(lamp_W));
    return std::min(1.0f, 0.3f + 0.45f * head + 0.35f * side);
  }

  const MeshScene& scene_;
  const PictureOptions& options_;
  bool coloured_;
  const std::vector<Eigen::Vector3f> normals_;
};

cv::Vec3b toBgr(const Eigen::Vector3f& rgb) {
  const auto channel = [&](int i) {
    return static_cast<uint8_t>(std::clamp(rgb[i] + 0.5f, 0.0f, 255.0f));
  };
  return {channel(2), channel(1), channel(0)};
}

Eigen::Vector3f pixelColour(const Shader& shader, int u, int v) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int j = 0; j < kSamplesPerSide; ++j) {
    for (int i = 0; i < kSamplesPerSide; ++i) {
      const auto offset = [](int k) {
        return (static_cast<float>(k) + 0.5f) / static_cast<float>(kSamplesPerSide) - 0.5f;
      };
      sum += shader.colourAt(static_cast<float>(u) + offset(i), static_cast<float>(v) + offset(j));
    }
  }
  return sum / static_cast<float>(kSamplesPerSide * kSamplesPerSide);
}

}  // namespace

Colour errorColour(double error_m, double scale_m) {
  constexpr double kStops[5][3] = {
      {222, 226, 230}, {255, 224, 120}, {250, 150, 50}, {215, 55, 40}, {110, 5, 30}};
  const double at = 4.0 * std::clamp(scale_m > 0.0 ? error_m / scale_m : 1.0, 0.0, 1.0);
  const int stop = std::min(3, static_cast<int>(at));
  Colour colour;
  for (size_t i = 0; i < 3; ++i) {
    const double low = kStops[stop][i], high = kStops[stop + 1][i];
    colour[i] = static_cast<uint8_t>(low + (at - stop) * (high - low) + 0.5);
  }
  return colour;
}

void colourByError(TriangleMesh& mesh, const std::vector<double>& errors_m, double scale_m) {
  mesh.colours.clear();
  for (const double error_m : errors_m) mesh.colours.push_back(errorColour(error_m, scale_m));
}

Eigen::Isometry3d framingPose(const Eigen::AlignedBox3f& bounds, const ViewCamera& camera,
                              double azimuth_deg, double elevation_deg) {
  const double azimuth = azimuth_deg * M_PI / 180.0, elevation = elevation_deg * M_PI / 180.0;
  const Eigen::Vector3d towards_eye(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                                    std::cos(elevation) * std::cos(azimuth));
  const Eigen::Vector3d centre_W = bounds.center().cast<double>();
  const double radius_m = 0.5 * static_cast<double>(bounds.diagonal().norm());
  const double half_px = 0.5 * static_cast<double>(std::min(camera.width, camera.height));
  const double half_angle = std::atan(half_px / static_cast<double>(camera.intrinsics.fx));
  const Eigen::Vector3d eye_W = centre_W + radius_m / std::sin(half_angle) * towards_eye;
  return lookAt(eye_W, centre_W, Eigen::Vector3d::UnitY());
}

void writePicture(const std::string& path, const MeshScene& scene, const PictureOptions& options) {
  const Shader shader(scene, options);
  cv::Mat image(options.camera.height, options.camera.width, CV_8UC3);
  parallelFor(static_cast<size_t>(image.rows), 0, [&](size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < image.cols; ++u) {
      image.at<cv::Vec3b>(v, u) = toBgr(pixelColour(shader, u, v));
    }
  });
  if (!cv::imwrite(path, image)) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace dtsdf
