#include "tools/benchmark_options.h"

namespace dtsdf {
namespace {

using BenchmarkOption = Option<BenchmarkOptions>;

std::vector<BenchmarkOption> inputOptions() {
  return {{"--raw", "NAME", "NAME.raw and NAME.txt, as pack_frames writes them, in place of --tum",
           [](auto& o, const auto& v) { o.raw_name = v; }},
          {"--flight", "",
           "a synthetic flight over hilly ground, in place of a recording: does the time of a "
           "frame stay the same while the map grows?",
           [](auto& o, const auto&) { o.flight = true; }},
          {"--grow-to-gib", "GIB", "size of the map at which the flight ends (default 1)",
           [](auto& o, const auto& v) { o.grow_to_gib = parsePositive("--grow-to-gib", v); }},
          {"--speed", "METRES", "way of the flight from frame to frame (default 1)",
           [](auto& o, const auto& v) { o.speed_m = parsePositive("--speed", v); }},
          {"--gpu", "", "only tell about the GPU: rates of its memory, registers of the kernels",
           [](auto& o, const auto&) { o.gpu_report = true; }}};
}

const std::vector<BenchmarkOption>& allOptions() {
  using O = BenchmarkOptions;
  static const std::vector<BenchmarkOption> options =
      joinOptions<O>({tumOptions<O>(), inputOptions(), frameOptions<O>(), mapperOptions<O>(),
                      reportOptions<O>()});
  return options;
}

void checkOptions(const BenchmarkOptions& options, const std::set<std::string>& given) {
  const int inputs = !options.tum_folder.empty() + !options.raw_name.empty() +
                     options.flight + options.gpu_report;
  if (inputs != 1) throw UsageError("give one of --tum DIR, --raw NAME, --flight and --gpu");
  for (const char* name : {"--grow-to-gib", "--speed"}) {
    if (given.count(name) > 0 && !options.flight) {
      throw UsageError(std::string(name) + " is only for --flight");
    }
  }
  if (given.count("--frames") > 0 && (options.flight || options.gpu_report)) {
    throw UsageError("--frames is only for --tum and --raw");
  }
  for (const char* name : {"--depth-scale", "--pose-tolerance"}) {
    if (given.count(name) > 0 && options.tum_folder.empty()) {
      throw UsageError(std::string(name) + " is only for --tum");
    }
  }
}

}  // namespace

BenchmarkOptions parseBenchmarkOptions(const std::vector<std::string>& arguments) {
  BenchmarkOptions options;
  const std::set<std::string> given = parseOptions(arguments, allOptions(), options);
  if (!options.help) checkOptions(options, given);
  return options;
}

std::string benchmarkHelp() {
  return "usage: benchmark (--tum DIR | --raw NAME | --flight | --gpu) [options]\n\n"
         "Measures what a frame takes, from its upload to the updated mesh, stage by stage.\n"
         "Frames are read or made before they are timed.\n\n" +
         describeOptions(allOptions()) +
         "\nExit code: 0 measured, 1 an error, 2 a wrong command line.\n";
}

}  // namespace dtsdf
