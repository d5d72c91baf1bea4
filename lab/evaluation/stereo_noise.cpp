#include "evaluation/stereo_noise.h"

#include <cmath>
#include <limits>

#include "simulation/random.h"

namespace dtsdf {

namespace {

constexpr double kStereoBaseline_m = 0.05;
constexpr double kDisparitySigma_px = 0.08;
constexpr double kStereoStep_px = 1.0 / 32.0;
constexpr int kMatchingWindow_px = 7;

constexpr int kTexturePatch_px = 15;
constexpr double kMinTexture = -1.9;  // 2.9 % of a standard normal distribution lie below

/// Two points whose disparities differ by less than this are assumed to lie on the same surface.
constexpr double kSameSurface_px = 1.0;

/// Keeps these random values independent of those used elsewhere.
constexpr uint64_t kDisparityStream = 0x64697370ULL, kTextureStream = 0x74657874ULL;

double disparityScale(const ViewCamera& camera) {
  return static_cast<double>(camera.intrinsics.fx) * kStereoBaseline_m;
}

/// Computes `count` sums of `window` consecutive values each, from a line of count + window - 1
/// values. Consecutive values, and consecutive sums, are `stride` elements apart.
void sumAlong(const std::vector<double>& values, size_t start, size_t stride, size_t count,
              size_t window, std::vector<double>& sums, size_t target) {
  double sum = 0.0;
  for (size_t k = 0; k + 1 < window; ++k) sum += values[start + k * stride];
  for (size_t i = 0; i < count; ++i) {
    sum += values[start + (i + window - 1) * stride];
    sums[target + i * stride] = sum;
    sum -= values[start + i * stride];
  }
}

/// Handles one row of seenByBoth(): marks the pixels that are not visible to the right camera. From
/// right to left, the pixels of a surface project to decreasing columns in the right image. If the
/// column of a pixel has already been passed, the pixel is occluded by the surface there.
void hideRow(const std::vector<float>& depth_m, size_t begin, int width, double scale,
             std::vector<bool>& seen) {
  double leftmost_px = std::numeric_limits<double>::infinity(), disparity_there_px = 0.0;
  for (int u = width - 1; u >= 0; --u) {
    const size_t pixel = begin + static_cast<size_t>(u);
    if (depth_m[pixel] <= 0.0f) continue;
    const double disparity_px = scale / static_cast<double>(depth_m[pixel]);
    const double column_px = u - disparity_px;
    const bool hidden =
        column_px >= leftmost_px && disparity_there_px > disparity_px + kSameSurface_px;
    seen[pixel] = !hidden && column_px >= 0.0;
    if (column_px < leftmost_px) {
      leftmost_px = column_px;
      disparity_there_px = disparity_px;
    }
  }
}

}  // namespace

std::vector<double> correlatedNormals(int width, int height, int window, uint64_t seed) {
  // With window - 1 additional columns and rows, every pixel has a complete window.
  const auto columns = static_cast<size_t>(width + window - 1);
  const auto rows = static_cast<size_t>(height + window - 1);
  Random random(seed);
  std::vector<double> white(columns * rows), along_rows(columns * rows), both(columns * rows);
  for (double& value : white) value = random.normal();
  const auto w = static_cast<size_t>(window);
  const auto wide = static_cast<size_t>(width), high = static_cast<size_t>(height);
  for (size_t v = 0; v < rows; ++v) {
    sumAlong(white, v * columns, 1, wide, w, along_rows, v * columns);
  }
  for (size_t u = 0; u < wide; ++u) sumAlong(along_rows, u, columns, high, w, both, u);
  std::vector<double> normals;
  normals.reserve(wide * high);
  for (size_t v = 0; v < high; ++v) {
    for (size_t u = 0; u < wide; ++u) normals.push_back(both[v * columns + u] / window);
  }
  return normals;
}

std::vector<bool> seenByBoth(const std::vector<float>& depth_m, const ViewCamera& camera) {
  std::vector<bool> seen(depth_m.size(), true);
  const auto width = static_cast<size_t>(camera.width);
  for (size_t begin = 0; begin + width <= depth_m.size(); begin += width) {
    hideRow(depth_m, begin, camera.width, disparityScale(camera), seen);
  }
  return seen;
}

void addStereoNoise(const std::vector<float>& true_m, const ViewCamera& camera, uint64_t seed,
                    std::vector<float>& measured_m) {
  const auto normals = [&](int window, uint64_t stream) {
    return correlatedNormals(camera.width, camera.height, window, seed ^ stream);
  };
  const std::vector<double> error = normals(kMatchingWindow_px, kDisparityStream),
                            texture = normals(kTexturePatch_px, kTextureStream);
  const std::vector<bool> seen = seenByBoth(true_m, camera);
  const double scale = disparityScale(camera);
  for (size_t i = 0; i < measured_m.size(); ++i) {
    if (measured_m[i] <= 0.0f) continue;
    const double off_px =
        scale / static_cast<double>(measured_m[i]) + kDisparitySigma_px * error[i];
    const double disparity_px = std::round(off_px / kStereoStep_px) * kStereoStep_px;
    const bool lost = disparity_px <= 0.0 || !seen[i] || texture[i] < kMinTexture;
    measured_m[i] = lost ? 0.0f : static_cast<float>(scale / disparity_px);
  }
}

}  // namespace dtsdf
