#include "evaluation/depth_noise.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "evaluation/depth_edges.h"
#include "evaluation/mixed_pixels.h"
#include "evaluation/stereo_noise.h"
#include "simulation/random.h"

namespace dtsdf {

namespace {

constexpr double kRightAngle_rad = 1.5707963267948966;
constexpr double kBaseline_m = 0.075;
constexpr double kDisparityStep_px = 0.125;

constexpr double kLossAtEdge = 0.5;

/// Away from depth edges, the probability that a pixel is lost grows linearly from 0 to 1 between
/// these angles.
constexpr double kFirstLostAngle_rad = 1.22;  // 70 degrees
constexpr double kLastSeenAngle_rad = 1.45;   // 83 degrees

/// Limits an angle, because the formulas diverge at a right angle.
double boundedAngle(double angle_rad) { return std::min(angle_rad, 1.5); }

/// Applies the noise model to the pixels of one view.
class NoisySensor {
 public:
  NoisySensor(const DepthView& view, const ViewCamera& camera, DepthNoise noise)
      : view_(view), camera_(camera), noise_(noise) {}

  float measure(int u, int v, Random& random) const {
    // Every pixel draws the same number of random values, so that its noise does not depend on
    // other pixels.
    const double step_u = random.normal(), step_v = random.normal(), along = random.normal();
    const double loss_draw = random.uniform();
    if (noise_ == DepthNoise::kKinect) {
      const double sigma_px = lateralSigma(angleAt(u, v));
      u = std::clamp(static_cast<int>(std::lround(u + sigma_px * step_u)), 0, camera_.width - 1);
      v = std::clamp(static_cast<int>(std::lround(v + sigma_px * step_v)), 0, camera_.height - 1);
    }
    double z_m = depthAt(u, v);
    if (z_m <= 0.0) return 0.0f;
    if (noise_ != DepthNoise::kTof && loss_draw < lossProbability(u, v)) return 0.0f;
    if (noise_ == DepthNoise::kKinect) z_m = quantise(z_m + axialSigma(z_m, angleAt(u, v)) * along);
    if (noise_ == DepthNoise::kTof) z_m += tofAxialSigma(z_m, angleAt(u, v)) * along;
    return static_cast<float>(std::max(z_m, 0.0));
  }

 private:
  float depthAt(int u, int v) const { return view_.depth_m[camera_.pixelAt(u, v)]; }
  double angleAt(int u, int v) const {
    if (depthAt(u, v) <= 0.0f) return 0.0;
    return std::acos(
        std::min(1.0, static_cast<double>(view_.incidence_cosine[camera_.pixelAt(u, v)])));
  }

  double lossProbability(int u, int v) const {
    const double flat =
        (angleAt(u, v) - kFirstLostAngle_rad) / (kLastSeenAngle_rad - kFirstLostAngle_rad);
    return std::max(std::clamp(flat, 0.0, 1.0), isAtEdge(u, v) ? kLossAtEdge : 0.0);
  }

  bool isAtEdge(int u, int v) const {
    const float z_m = depthAt(u, v);
    for (int dv = -1; dv <= 1; ++dv) {
      for (int du = -1; du <= 1; ++du) {
        const int nu = std::clamp(u + du, 0, camera_.width - 1);
        const int nv = std::clamp(v + dv, 0, camera_.height - 1);
        if (isDepthEdge(z_m, depthAt(nu, nv))) return true;
      }
    }
    return false;
  }

  double quantise(double z_m) const {
    const double scale = static_cast<double>(camera_.intrinsics.fx) * kBaseline_m;
    const double steps = std::round(scale / z_m / kDisparityStep_px);
    return steps >= 1.0 ? scale / (steps * kDisparityStep_px) : 0.0;
  }

  const DepthView& view_;
  const ViewCamera& camera_;
  DepthNoise noise_;
};

}  // namespace

DepthNoise depthNoiseFromName(const std::string& name) {
  if (name == "none") return DepthNoise::kNone;
  if (name == "kinect") return DepthNoise::kKinect;
  if (name == "tof") return DepthNoise::kTof;
  if (name == "stereo") return DepthNoise::kStereo;
  throw std::invalid_argument("unknown noise '" + name + "'; use none, kinect, tof or stereo");
}

double axialSigma(double z_m, double angle_rad) {
  const double frontal_m = 0.0012 + 0.0019 * (z_m - 0.4) * (z_m - 0.4);
  constexpr double kSlanted_rad = kRightAngle_rad * 2.0 / 3.0;  // 60 degrees
  if (angle_rad <= kSlanted_rad) return frontal_m;
  const double angle = boundedAngle(angle_rad), rest = kRightAngle_rad - angle;
  return frontal_m + 0.0001 / std::sqrt(z_m) * angle * angle / (rest * rest);
}

double tofAxialSigma(double z_m, double angle_rad) {
  const double angle = boundedAngle(angle_rad), rest = kRightAngle_rad - angle;
  const double slant = angle * angle / (rest * rest);
  return 1e-3 * (1.5 - 0.5 * z_m + 0.3 * z_m * z_m + 0.1 * z_m * std::sqrt(z_m) * slant);
}

double lateralSigma(double angle_rad) {
  const double angle = boundedAngle(angle_rad);
  return 0.8 + 0.035 * angle / (kRightAngle_rad - angle);
}

namespace {

/// Applies the noise model to each pixel of the view.
std::vector<float> addPixelNoise(const DepthView& view, const ViewCamera& camera, DepthNoise noise,
                                 uint64_t seed) {
  const NoisySensor sensor(view, camera, noise);
  Random random(seed);
  std::vector<float> depth_m(view.depth_m.size());
  size_t pixel = 0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) depth_m[pixel++] = sensor.measure(u, v, random);
  }
  return depth_m;
}

}  // namespace

std::vector<float> addNoise(const DepthView& view, const ViewCamera& camera, DepthNoise noise,
                            uint64_t seed) {
  if (noise == DepthNoise::kNone) return view.depth_m;
  DepthView seen = view;
  if (noise == DepthNoise::kTof) seen.depth_m = mixPixels(view.depth_m, camera, seed);
  std::vector<float> depth_m = addPixelNoise(seen, camera, noise, seed);
  if (noise == DepthNoise::kStereo) addStereoNoise(view.depth_m, camera, seed, depth_m);
  return depth_m;
}

}  // namespace dtsdf
