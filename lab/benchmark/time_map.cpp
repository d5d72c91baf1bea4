// time_map: how long it takes to load, copy and save a map.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "program/command_line.h"
#include "program/run_program.h"
#include "program/stopwatch.h"

namespace dtsdf {
namespace {

struct TimeOptions {
  std::string path;
  std::string folder = std::filesystem::temp_directory_path().string();
  std::string backend = "auto";
  int threads = 0, repeats = 5;
};

TimeOptions parse(const std::vector<std::string>& arguments) {
  TimeOptions options;
  CommandLine line("time_map", "FILE [options]",
                   "Measures how long it takes to load a map file, restore it in a mapper, copy it "
                   "and save it: the shortest of several runs.");
  line.addText({"FILE", "", "a map file"}, options.path);
  line.addText({"--folder", "FOLDER", "folder that the map is saved to"}, options.folder);
  line.addText({"--backend", "auto|cpu|cuda", "backend of the mapper"}, options.backend);
  line.addWhole({"--threads", "N", "CPU threads (0: all cores)"}, options.threads, {0, 1024});
  line.addWhole({"--repeats", "N", "repetitions"}, options.repeats, {1, 1000});
  line.parse(arguments);
  return options;
}

MapperParams paramsFor(const MapContents& contents, const TimeOptions& options) {
  ParamTree tree;
  tree["backend"] = options.backend;
  tree["threads"] = options.threads;
  MapperParams params = withSettingsOf(contents, readMapperParams(tree));
  params.map.max_memory_mb = leastMemoryMb(contents, params);
  return params;
}

/// Times `action`, and prints what it comes to for so many bytes.
void printTime(const char* what, const TimeOptions& options, uint64_t bytes,
               const std::function<void()>& action) {
  double wall_s = 1e9, core_s = 1e9;
  for (int i = 0; i < options.repeats; ++i) {
    const double core_start_s = processorSeconds();
    const Stopwatch watch;
    action();
    wall_s = std::min(wall_s, watch.seconds());
    core_s = std::min(core_s, processorSeconds() - core_start_s);
  }
  const double megabytes = static_cast<double>(bytes) / 1e6;
  std::printf("%-8s %10.3f %12.3f %12.0f %18.0f\n", what, wall_s,
              wall_s * (1 << 30) / static_cast<double>(bytes), megabytes / wall_s,
              megabytes / core_s);
}

void timeMap(const std::vector<std::string>& arguments) {
  const TimeOptions options = parse(arguments);
  MapContents contents = loadMap(options.path);
  const uint64_t bytes =
      contents.voxels.size() * sizeof(uint64_t) + contents.colours.size() * sizeof(uint32_t);
  if (bytes == 0) throw std::runtime_error("the map '" + options.path + "' is empty");
  const MapperParams params = paramsFor(contents, options);
  std::unique_ptr<Mapper> mapper = makeMapper(params, contents);
  std::printf("%.1f MB of voxels and colours, %.1f MB in the file, %s\n",
              static_cast<double>(bytes) / 1e6,
              static_cast<double>(std::filesystem::file_size(options.path)) / 1e6,
              mapper->backendName().c_str());
  const std::string name = "time_map_" + std::to_string(getpid()) + kMapExtension;
  const std::string scratch = (std::filesystem::path(options.folder) / name).string();
  std::printf("%-8s %10s %12s %12s %18s\n", "", "seconds", "s per GiB", "MB/s",
              "MB per core-second");
  printTime("load", options, bytes, [&] { loadMap(options.path, kNoMapLimit, options.threads); });
  printTime("take in", options, bytes, [&] { makeMapper(params, contents); });
  printTime("copy", options, bytes, [&] { mapper->contents(); });
  printTime("save", options, bytes, [&] { saveMap(contents, scratch, options.threads); });
  std::filesystem::remove(scratch);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("time_map", argc, argv, dtsdf::timeMap);
}
