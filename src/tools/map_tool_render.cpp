// map_tool render: renders views of a map, as a recording in TUM format.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>

#include "io/atomic_file.h"
#include "io/camera_file.h"
#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "io/trajectory.h"
#include "params/text.h"
#include "program/progress_bar.h"
#include "program/run_program.h"
#include "program/stopwatch.h"
#include "tools/map_tool.h"
#include "tools/reconstruction_report.h"

namespace dtsdf {
namespace {

/// Depth units per metre, as in the TUM benchmark.
constexpr float kUnitsPerMetre = 5000.0f;

StampedPose readPose(const std::string& text) {
  const std::vector<double> numbers = readNumbers(text);
  if (numbers.size() != 7) throw UsageError("a pose has seven numbers: TX,TY,TZ,QX,QY,QZ,QW");
  const auto T_W_C = poseOf({numbers[0], numbers[1], numbers[2]},
                            {numbers[6], numbers[3], numbers[4], numbers[5]});
  if (!T_W_C) throw UsageError("the quaternion's length is not 1");
  return {0.0, *T_W_C};
}

/// Converts depth to 16 bits; 0 where there is no surface or the depth is out of range.
DepthImage depthImageOf(const RenderedView& view) {
  DepthImage image{view.width, view.height, std::vector<uint16_t>(view.depth_m.size())};
  constexpr float kMax = std::numeric_limits<uint16_t>::max() - 1;  // 65535 also means no depth
  std::transform(view.depth_m.begin(), view.depth_m.end(), image.values.begin(), [](float depth_m) {
    const float units = std::floor(kUnitsPerMetre * depth_m + 0.5f);
    return static_cast<uint16_t>(units <= kMax ? units : 0.0f);
  });
  return image;
}

RgbImage normalImageOf(const RenderedView& view) {
  RgbImage image{view.width, view.height, {}};
  const auto code = [](float x) { return static_cast<uint8_t>(128.5f + 127.0f * x); };
  for (size_t i = 0; i < view.normals_C.size(); ++i) {
    const bool is_seen = view.depth_m[i] > 0.0f;
    const Vec3f& n = view.normals_C[i];
    for (const float x : {n.x, n.y, n.z}) image.values.push_back(is_seen ? code(x) : uint8_t{0});
  }
  return image;
}

/// The colours of a view; unpainted surfaces are grey.
RgbImage colourImageOf(const RenderedView& view) {
  constexpr uint8_t kUnpainted = 128;
  RgbImage image{view.width, view.height, {}};
  for (size_t i = 0; i < view.colours.size(); ++i) {
    const VertexColour& colour = view.colours[i];
    const bool is_grey = view.depth_m[i] > 0.0f && colour.painted == 0;
    for (const uint8_t x : {colour.red, colour.green, colour.blue}) {
      image.values.push_back(is_grey ? kUnpainted : x);
    }
  }
  return image;
}

/// Renders a view from each pose and saves the views as a recording. @return the time of each
/// rendering, in milliseconds.
std::vector<double> renderInto(const std::string& folder, const RenderCamera& camera,
                               const std::vector<StampedPose>& poses, Mapper& mapper) {
  writeFileAtomically(folder + "/camera_info.yaml", cameraInfoText(camera, "rendered"));
  RenderedView view;
  std::vector<double> times_ms;
  std::string depth_list, colour_list;
  ProgressBar progress("views", poses.size());
  for (const StampedPose& pose : poses) {
    const std::string name = formatted("%06zu.png", times_ms.size());
    const auto begin = std::chrono::steady_clock::now();
    mapper.render(camera, pose.T_W_C, view);
    times_ms.push_back(millisecondsSince(begin));
    const auto write = [&](const std::string& kind, const std::string& png) {
      writeFileAtomically(folder + "/" + kind + "/" + name, png);
      return stampOfList(pose.stamp_s) + " " + kind + "/" + name + "\n";
    };
    depth_list += write("depth", encodeDepthPng(depthImageOf(view)));
    write("normals", encodeColourPng(normalImageOf(view)));
    if (!view.colours.empty()) colour_list += write("rgb", encodeColourPng(colourImageOf(view)));
    progress.show(times_ms.size());
  }
  writeFileAtomically(folder + "/depth.txt", depth_list);
  if (!colour_list.empty()) writeFileAtomically(folder + "/rgb.txt", colour_list);
  saveTrajectory(poses, folder + "/groundtruth.txt");
  return times_ms;
}

}  // namespace

void renderMap(const std::vector<std::string>& arguments) {
  MapToolOptions options;
  std::string camera_path, trajectory_path;
  std::vector<StampedPose> poses;
  CommandLine line("map_tool render", "FILE OUT [options]",
                   "Renders views of a map into a folder in the format of the TUM "
                   "benchmark: depth (16-bit PNG, 5000 units per metre), normals (128 + 127 times "
                   "x, y and z in the camera's frame) and, if the map is painted, rgb.");
  addPaths(line, "folder to write", options);
  line.add({"--pose", "TX,TY,TZ,QX,QY,QZ,QW",
            "pose of the camera's optical frame in the map frame: "
            "metres, then a quaternion"},
           [&](const std::string& text) { poses.push_back(readPose(text)); });
  line.addText({"--trajectory", "FILE",
                "poses of the views: `stamp tx ty tz qx qy qz qw` per line, camera to map"},
               trajectory_path);
  line.requireOneOf({"--pose", "--trajectory"});
  line.addText({"--camera", "FILE",
                "camera_info.yaml with size and intrinsics (default: 640 x 480 "
                "pixels, focal length 525)"},
               camera_path);
  addSettings(line, "mesh/..., backend, threads", options);
  line.parse(arguments);
  if (!trajectory_path.empty())
    poses = readTrajectory(trajectory_path, "give a file of poses").poses();
  if (poses.empty()) throw std::runtime_error("'" + trajectory_path + "' contains no poses");
  const RenderCamera camera = camera_path.empty() ? RenderCamera() : loadCameraInfo(camera_path);
  // Views do not depend on the free-space grid.
  const auto mapper = loadMapOf(options, "space/enabled=false").second;
  const std::vector<double> times_ms = renderInto(options.out_path, camera, poses, *mapper);
  std::printf("%zu views of %d x %d pixels, median %.2f ms: %s\n", times_ms.size(), camera.width,
              camera.height, summarise(times_ms).median, options.out_path.c_str());
}

}  // namespace dtsdf
