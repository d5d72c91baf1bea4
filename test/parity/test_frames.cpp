#include "parity/test_frames.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "simulation/scene.h"

namespace dtsdf {
namespace {

constexpr float kUint16Unit_m = 0.001f;

/// Adds the noise of a triangulating camera, and removes about one in 97 measurements.
void addNoise(std::vector<float>& depth_m, std::mt19937& random) {
  for (float& z : depth_m) {
    const double share = random() / 4294967296.0 - 0.5;
    z += static_cast<float>(0.005 * share) * z * z;
    if (random() % 97 == 0) z = 0.0f;
  }
}

template <class T>
void store(const std::vector<T>& values, TestFrame& frame, size_t row_bytes) {
  const size_t row = frame.frame.width * sizeof(T);
  frame.frame.row_bytes = row_bytes;
  frame.pixels.assign(row_bytes * frame.frame.height, 0xab);
  for (int v = 0; v < frame.frame.height; ++v) {
    std::memcpy(&frame.pixels[v * row_bytes], &values[static_cast<size_t>(v) * frame.frame.width],
                row);
  }
}

void encode(const std::vector<float>& depth_m, bool noise, TestFrame& frame) {
  if (frame.frame.encoding == DepthEncoding::kUint16) {
    std::vector<uint16_t> units;
    for (const float z : depth_m) {
      units.push_back(static_cast<uint16_t>(std::lround(z / kUint16Unit_m)));
    }
    frame.frame.unit_m = kUint16Unit_m;
    store(units, frame, frame.frame.width * sizeof(uint16_t) + 6);  // padded rows
    return;
  }
  std::vector<float> metres = depth_m;
  for (float& z : metres) {
    if (noise && !(z > 0.0f)) z = std::numeric_limits<float>::quiet_NaN();
  }
  frame.frame.unit_m = 1.0f;
  store(metres, frame, frame.frame.width * sizeof(float));
}

}  // namespace

std::vector<TestFrame> makeTestFrames(const TestFrameSettings& settings) {
  const Scene scene = makeRoomScene();
  std::mt19937 random(7);
  std::vector<TestFrame> frames(settings.count);
  for (int i = 0; i < settings.count; ++i) {
    DepthFrame& frame = frames[i].frame;
    frame.width = settings.width;
    frame.height = settings.height;
    frame.encoding = settings.encoding;
    const float focal_px = 0.85f * static_cast<float>(settings.width);
    frame.intrinsics = {focal_px, focal_px, 0.5f * static_cast<float>(settings.width - 1),
                        0.5f * static_cast<float>(settings.height - 1)};
    frame.T_W_C = roomCameraPose(settings.first_s + i * settings.step_s);
    std::vector<float> depth_m =
        renderDepth(scene, frame.intrinsics, frame.width, frame.height, frame.T_W_C);
    frame.T_W_C.pretranslate(settings.offset_W);
    if (settings.noise) addNoise(depth_m, random);
    encode(depth_m, settings.noise, frames[i]);
  }
  return frames;
}

std::vector<TestColours> makeTestColours(const TestFrameSettings& settings, int width, int height,
                                         ColourEncoding encoding) {
  std::mt19937 random(8);
  const size_t channels = encoding == ColourEncoding::kMono8 ? 1 : 3;
  std::vector<TestColours> images(settings.count);
  for (int i = 0; i < settings.count; ++i) {
    ColourFrame& frame = images[i].frame;
    frame.width = width;
    frame.height = height;
    frame.encoding = encoding;
    frame.row_bytes = width * channels + 3;  // padded rows
    const float focal_px = 0.8f * static_cast<float>(width);
    frame.intrinsics = {focal_px, 1.01f * focal_px, 0.5f * static_cast<float>(width - 1),
                        0.5f * static_cast<float>(height - 1)};
    frame.T_W_C = roomCameraPose(settings.first_s + (i + 0.1) * settings.step_s) *
                  Eigen::Translation3d(0.05, 0.0, 0.0);
    frame.T_W_C.pretranslate(settings.offset_W);
    images[i].pixels.resize(frame.row_bytes * height);
    const double bright = 0.8 + 0.2 * std::sin(2.0 * i);
    for (size_t at = 0; at < images[i].pixels.size(); ++at) {
      const double pattern = 120.0 + 100.0 * std::sin(0.002 * static_cast<double>(at));
      images[i].pixels[at] = static_cast<unsigned char>(bright * pattern + random() % 32);
    }
  }
  return images;
}

}  // namespace dtsdf
