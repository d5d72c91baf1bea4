#include "evaluation/surface_texture.h"

#include <cmath>
#include <stdexcept>

namespace dtsdf {
namespace {

/// Origin of the textures, chosen so that faces of models rarely lie in its coordinate planes.
const Eigen::Vector3d kTextureOrigin(0.0173, 0.0119, 0.0241);

Rgb8 checkerAt(const Eigen::Vector3d& p) {
  constexpr double kSide_m = 0.05;
  const Eigen::Vector3d cell = ((p - kTextureOrigin) / kSide_m).array().floor();
  const auto sum = static_cast<long>(cell.sum());
  return (sum & 1) != 0 ? Rgb8{215, 190, 140} : Rgb8{45, 70, 110};
}

Rgb8 gradientAt(const Eigen::Vector3d& p) {
  constexpr double kWave_m = 0.4;
  Rgb8 colour;
  for (int i = 0; i < 3; ++i) {
    const double phase = 2.0 * M_PI * (p[i] - kTextureOrigin[i]) / kWave_m;
    const double value = 128.0 + 90.0 * std::sin(phase);
    colour[static_cast<size_t>(i)] = static_cast<uint8_t>(std::lround(value));
  }
  return colour;
}

/// Barycentric weights of a triangle's corners at a point. Negative weights are clamped to 0.
Eigen::Vector3d barycentric(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double area = normal.squaredNorm();
  if (!(area > 0.0)) return {1.0, 0.0, 0.0};
  Eigen::Vector3d weights((c - b).cross(p - b).dot(normal) / area,
                          (a - c).cross(p - c).dot(normal) / area, 0.0);
  weights[2] = 1.0 - weights[0] - weights[1];
  weights = weights.cwiseMax(0.0);
  return weights / weights.sum();
}

double toLinear(double value) {
  const double share = value / 255.0;
  return share <= 0.04045 ? share / 12.92 : std::pow((share + 0.055) / 1.055, 2.4);
}

double labCurve(double t) {
  constexpr double kDelta = 6.0 / 29.0;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
}

}  // namespace

Texture textureFromName(const std::string& name) {
  if (name == "vertices") return Texture::kVertices;
  if (name == "checker") return Texture::kChecker;
  if (name == "gradient") return Texture::kGradient;
  throw std::invalid_argument("unknown texture '" + name + "'; use vertices, checker or gradient");
}

Eigen::Vector3d vertexColourAt(const TriangleMesh& mesh, uint32_t triangle,
                               const Eigen::Vector3f& p) {
  const auto& corners = mesh.triangles[triangle];
  const auto corner = [&](size_t i) -> Eigen::Vector3d {
    return mesh.vertices[corners[i]].cast<double>();
  };
  const Eigen::Vector3d weights = barycentric(p.cast<double>(), corner(0), corner(1), corner(2));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < 3; ++i) {
    const Rgb8& colour = mesh.colours[corners[i]];
    sum += weights[static_cast<int>(i)] * Eigen::Vector3d(colour[0], colour[1], colour[2]);
  }
  return sum;
}

Rgb8 textureColour(Texture texture, const TriangleMesh& mesh, uint32_t triangle,
                   const Eigen::Vector3f& p) {
  if (texture == Texture::kChecker) return checkerAt(p.cast<double>());
  if (texture == Texture::kGradient) return gradientAt(p.cast<double>());
  const Eigen::Vector3d colour = vertexColourAt(mesh, triangle, p);
  return {static_cast<uint8_t>(std::lround(colour[0])),
          static_cast<uint8_t>(std::lround(colour[1])),
          static_cast<uint8_t>(std::lround(colour[2]))};
}

Eigen::Vector3d toLab(const Eigen::Vector3d& rgb) {
  const Eigen::Vector3d linear(toLinear(rgb[0]), toLinear(rgb[1]), toLinear(rgb[2]));
  Eigen::Matrix3d to_xyz;
  to_xyz << 0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920,
      0.9503041;
  const Eigen::Vector3d white(0.95047, 1.0, 1.08883);
  const Eigen::Vector3d xyz = (to_xyz * linear).cwiseQuotient(white);
  const double x = labCurve(xyz[0]), y = labCurve(xyz[1]), z = labCurve(xyz[2]);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

}  // namespace dtsdf
