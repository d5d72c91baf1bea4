/// benchmark: measures time and memory per frame, from its upload to the updated mesh.
#include <algorithm>
#include <cstdio>

#include "benchmark/benchmark_options.h"
#include "benchmark/benchmark_report.h"
#include "benchmark/flight.h"
#include "benchmark/raw_frames.h"
#include "io/atomic_file.h"
#include "mapper/probed_mapper.h"
#include "program/progress_bar.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

std::vector<SourceFrame> readFrames(const BenchmarkOptions& options) {
  const auto source = options.raw_name.empty()
                          ? openRecording(options.recording)
                          : openRawFrames(options.raw_name, options.recording.selection);
  std::vector<SourceFrame> frames;
  while (std::optional<SourceFrame> frame = source->next()) frames.push_back(std::move(*frame));
  return frames;
}

std::string measureFrames(const BenchmarkOptions& options, const RunSettings& settings) {
  const std::vector<SourceFrame> frames = readFrames(options);
  Measurement measurement;
  {
    ProgressBar progress("frames", 2 * frames.size());
    measurement = measure(frames, settings.params.mapper, settings.rules,
                          [&](size_t done) { progress.show(done); });
  }
  return reportMeasurement(measurement);
}

std::string measureFlight(const BenchmarkOptions& options, const RunSettings& settings) {
  constexpr size_t kMiB = 1024 * 1024;
  const auto map_mib = static_cast<size_t>(options.grow_to_gib * 1024.0);
  MapperParams params = settings.params.mapper;
  // Leave room for the last frame, unless the map drops distant blocks or writes blocks to disk.
  if (params.map.keep_radius_m == 0.0f && params.map.page_folder.empty()) {
    params.map.max_memory_mb = std::max(params.map.max_memory_mb, static_cast<int>(map_mib) + 1024);
  }
  Measurement end;
  const size_t taken = gpuMemoryTaken();
  const auto mapper = makeProbedMapper(params, settings.rules);
  std::vector<FrameTime> times;
  {
    ProgressBar progress("MiB", map_mib);
    times = fly(*mapper, map_mib * kMiB, options.speed_m, options.returns,
                [&](size_t bytes) { progress.show(bytes / kMiB); });
  }
  end.backend_name = mapper->backendName();
  end.map = mapper->stats();
  end.memory = mapper->memory();
  end.device_bytes = gpuMemoryTakenSince(taken);
  return reportFlight(times, end);
}

void run(const BenchmarkOptions& options) {
  if (!options.report_path.empty()) prepareOutputFile(options.report_path);
  const RunSettings settings = readSettings(options);
  if (isLevelled(settings.params)) {
    std::fputs("benchmark: warning: map/level is ignored; the map is not levelled\n", stderr);
  }
  const std::string report =
      options.flight ? measureFlight(options, settings) : measureFrames(options, settings);
  if (!options.report_path.empty()) writeFileAtomically(options.report_path, report);
  std::fputs(report.c_str(), stdout);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("benchmark", argc, argv, dtsdf::parseBenchmarkOptions, dtsdf::run);
}
