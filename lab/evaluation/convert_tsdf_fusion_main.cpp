/// convert_tsdf_fusion: makes a TUM folder from a recording in tsdf-fusion's layout.

#include <cstdio>
#include <filesystem>

#include "evaluation/depth_renderer.h"
#include "evaluation/parallel.h"
#include "evaluation/tsdf_fusion_folder.h"
#include "program/command_line.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct ConvertOptions {
  std::string input, output;
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;

  Intrinsics intrinsics() const {
    return {static_cast<float>(fx_px), static_cast<float>(fy_px), static_cast<float>(cx_px),
            static_cast<float>(cy_px)};
  }
};

ConvertOptions readOptions(const std::vector<std::string>& arguments) {
  ConvertOptions options;
  CommandLine line("convert_tsdf_fusion", "DIR OUT --fx F --fy F --cx C --cy C",
                   "Makes the TUM folder OUT from a recording in the layout of tsdf-fusion and "
                   "7-Scenes: frame-NUMBER.depth.png in millimetres and frame-NUMBER.pose.txt, "
                   "camera to world. Frames without a pose are left out.",
                   kExitCodes);
  line.addText({"DIR", "", "the recording"}, options.input);
  line.addText({"OUT", "", "the folder"}, options.output);
  constexpr double kLargest_px = 1e5;
  line.addNumber({"--fx", "PIXELS", "focal length"}, options.fx_px, {1.0, kLargest_px});
  line.addNumber({"--fy", "PIXELS", "focal length"}, options.fy_px, {1.0, kLargest_px});
  line.addNumber({"--cx", "PIXELS", "principal point"}, options.cx_px, {0.0, kLargest_px});
  line.addNumber({"--cy", "PIXELS", "principal point"}, options.cy_px, {0.0, kLargest_px});
  for (const char* name : {"--fx", "--fy", "--cx", "--cy"}) line.require(name);
  line.parse(arguments);
  return options;
}

void convert(const ConvertOptions& options) {
  const TsdfFusionFolder folder = readTsdfFusionFolder(options.input);
  const ViewCamera camera = cameraForImage(folder.frames.front().depth_path, options.intrinsics());
  std::vector<Eigen::Isometry3d> poses_W_C;
  for (const TsdfFusionFrame& frame : folder.frames) poses_W_C.push_back(frame.T_W_C);
  const TumWriter writer(options.output, camera, poses_W_C);
  forEachImage(poses_W_C.size(), [&](size_t i) {
    writer.write(i, toTumDepth(readMillimetres(folder.frames[i].depth_path, camera)));
  });
  writer.finish(std::filesystem::path(options.input).filename().string());
  std::printf("%zu frames, %zu without a pose left out\n", folder.frames.size(),
              folder.without_pose);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  using namespace dtsdf;
  return runProgram(
      "convert_tsdf_fusion", argc, argv,
      [](const std::vector<std::string>& arguments) { convert(readOptions(arguments)); });
}
