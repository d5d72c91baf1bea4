#include "benchmark/flight.h"

#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <fstream>

#include "threads/parallel.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr Intrinsics kIntrinsics{525.0f, 525.0f, 319.5f, 239.5f};
constexpr double kEyeHeight_m = 4.0;
constexpr float kUnit_m = 0.0002f;

/// Depth at which a ray with the given slope (metres along x and y per metre down) hits the ground.
/// The slope of the ray times that of the ground is below 1, so the iteration converges.
double depthOf(double x_m, double slope_x, double slope_y) {
  constexpr int kSteps = 10;
  double depth_m = kEyeHeight_m;
  for (int i = 0; i < kSteps; ++i) {
    depth_m = kEyeHeight_m - groundHeight(x_m + depth_m * slope_x, depth_m * slope_y);
  }
  return depth_m;
}

/// Bytes mapped so far: in memory, on disk and dropped. Dropped blocks are assumed to have had the
/// mean size of the blocks in memory.
size_t mappedBytes(const MapStats& map) {
  if (map.blocks == 0) return 0;
  return map.map_bytes + map.pages.bytes +
         static_cast<size_t>(map.dropped_blocks) * (map.map_bytes / map.blocks);
}

/// Resident memory of this process in bytes; 0 if the system does not report it.
size_t residentBytes() {
  size_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

double groundHeight(double x_m, double y_m) {
  return 0.35 * std::sin(0.9 * x_m) * std::cos(0.8 * y_m) + 0.05 * std::sin(3.1 * x_m + 1.3 * y_m) +
         0.02 * std::sin(7.3 * y_m - 4.1 * x_m);
}

SourceFrame renderFlightFrame(double x_m) {
  const auto image = std::make_shared<std::vector<uint16_t>>(kWidth * kHeight);
  parallelFor(kHeight, 0, [&](size_t v) {
    const double slope_y =
        -(static_cast<double>(v) - static_cast<double>(kIntrinsics.cy)) / kIntrinsics.fy;
    for (int u = 0; u < kWidth; ++u) {
      const double slope_x = (u - kIntrinsics.cx) / kIntrinsics.fx;
      (*image)[v * kWidth + u] =
          static_cast<uint16_t>(std::lround(depthOf(x_m, slope_x, slope_y) / kUnit_m));
    }
  });
  SourceFrame frame;
  frame.depth.data = image->data();
  frame.depth.row_bytes = kWidth * sizeof(uint16_t);
  frame.depth.width = kWidth;
  frame.depth.height = kHeight;
  frame.depth.unit_m = kUnit_m;
  frame.depth.intrinsics = kIntrinsics;
  frame.depth.T_W_C.linear() = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  frame.depth.T_W_C.translation() = Eigen::Vector3d(x_m, 0.0, kEyeHeight_m);
  frame.pixels = image;
  return frame;
}

std::vector<FrameTime> fly(ProbedMapper& mapper, size_t map_bytes, double speed_m, bool returns,
                           const std::function<void(size_t)>& show_progress) {
  std::vector<FrameTime> times;
  const auto fly_over = [&](size_t place) {
    const SourceFrame frame = renderFlightFrame(speed_m * static_cast<double>(place));
    times.push_back(timeFrame(mapper, frame.depth, [](const MeshUpdate&) {}));
    times.back().resident_bytes = residentBytes();
  };
  do {
    fly_over(times.size());
    times.back().mapped_bytes = mappedBytes(mapper.stats());
    show_progress(times.back().mapped_bytes);
  } while (times.back().mapped_bytes < map_bytes);
  if (!returns) return times;
  for (size_t place = times.size(); place-- > 0;) {
    fly_over(place);
    times.back().mapped_bytes = times[place].mapped_bytes;
    times.back().on_return = true;
    show_progress(times.back().mapped_bytes);
  }
  return times;
}

}  // namespace dtsdf
