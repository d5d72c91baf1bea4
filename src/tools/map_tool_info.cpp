// map_tool info: prints what is in a map file.
#include <cstdio>

#include "io/map_chunks.h"
#include "level/level_pose.h"
#include "params/param_copy.h"
#include "params/printable.h"
#include "params/text.h"
#include "program/command_line.h"
#include "program/run_program.h"
#include "tools/map_settings.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

void print(const char* what, const std::string& text) {
  std::printf("%-14s %s\n", what, text.c_str());
}

/// Bounds of the blocks in the map frame.
std::string describeBounds(const MapInfo& info, double voxel_size_m) {
  const double block_m = voxel_size_m * kBlockSide;
  return formatted("%.2f %.2f %.2f to %.2f %.2f %.2f m", info.least.x * block_m,
                   info.least.y * block_m, info.least.z * block_m, (info.most.x + 1) * block_m,
                   (info.most.y + 1) * block_m, (info.most.z + 1) * block_m);
}

std::string describePoses(PoseMode mode) {
  switch (mode) {
    case PoseMode::kTf: return "used as supplied";
    case PoseMode::kRefine: return "refined by alignment to the map";
    case PoseMode::kTrack: return "tracked by alignment to the map";
  }
  return "";
}

void printMap(const MapInfo& info) {
  MapContents bound;
  bound.settings = copyOf(info.settings);
  const MapperParams params = withSettingsOf(bound, {});
  const auto voxel_size_m = static_cast<double>(params.map.voxel_size_m);
  print("voxel size", formatted("%.7g m", voxel_size_m));
  print("truncation", formatted("%.7g voxels", static_cast<double>(params.map.truncation_voxels)));
  print("mode", std::string(params.map.directional ? "directional" : "undirected") + ", " +
                    std::get<std::string>(info.settings.at("fusion/mode")));
  print("map frame", info.map_frame.empty() ? "not named" : "'" + printable(info.map_frame) + "'");
  if (info.T_W_M) print("levelled", describeLevel(*info.T_W_M));
  print("poses", describePoses(info.poses.mode));
  print("frames", std::to_string(info.frames));
  print("newest stamp", info.stamp_s == 0.0 ? "not known" : formatted("%.6f s", info.stamp_s));
  print("blocks", std::to_string(info.size.blocks));
  print("voxel arrays", std::to_string(info.size.voxel_arrays));
  print("colour", info.painted ? std::to_string(info.size.bricks) + " bricks" : "none");
  print("free space", info.cell_voxels == 0 ? "none"
                                            : formatted("%zu cubes of 8 x 8 x 8 cells of %d voxels",
                                                        info.size.free_cubes, info.cell_voxels));
  print("memory", formatted("%.1f MiB", static_cast<double>(info.size.bytes()) / (1 << 20)));
  if (info.size.blocks > 0) print("bounds", describeBounds(info, voxel_size_m));
  print("content hash", formatted("%016llx", static_cast<unsigned long long>(info.content_hash)));
}

void printSettings(const MapInfo& info) {
  std::printf("\n");
  for (const auto& [key, value] : info.settings) {
    std::printf("%s: %s\n", printable(key).c_str(), printable(toString(value)).c_str());
  }
}

}  // namespace

void printMapInfo(const std::vector<std::string>& arguments) {
  std::string path;
  bool with_settings = false, verify = false;
  CommandLine line("map_tool info", "FILE [options]",
                   "Prints what is in a map file. Reads voxels and colours only with --verify.");
  line.addText({"FILE", "", "a map file"}, path);
  line.addFlag("--settings", "also print the settings and rule parameters of the map",
               with_settings);
  line.addFlag("--verify", "read the whole file and check its checksums", verify);
  line.parse(arguments);
  const MapInfo info = readMapInfo(path);
  print("file", path);
  print("file size", std::to_string(info.file_bytes) + " bytes");
  printMap(info);
  if (with_settings) printSettings(info);
  if (verify) {
    MapChunks(path).visit([](const MapContents&) {});  // checks each chunk
    std::printf("\nall checksums match\n");
  }
}

}  // namespace dtsdf
