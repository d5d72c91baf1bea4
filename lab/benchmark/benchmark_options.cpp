#include "benchmark/benchmark_options.h"

namespace dtsdf {
namespace {

void addFlightOptions(CommandLine& line, BenchmarkOptions& options) {
  line.addFlag("--flight",
               "simulate a flight over hilly ground instead of reading a recording, to test "
               "whether the time per frame stays constant while the map grows",
               options.flight);
  line.addNumber({"--grow-to-gib", "GIB", "size of the map in GiB at which the flight ends"},
                 options.grow_to_gib, {kAboveZero, kUnbounded});
  line.addNumber({"--speed", "METRES", "distance flown per frame, in metres"}, options.speed_m,
                 {kAboveZero, kUnbounded});
  line.addFlag("--return", "fly back along the same path afterwards", options.returns);
  line.onlyWith("--grow-to-gib", "--flight");
  line.onlyWith("--return", "--flight");
  line.onlyWith("--speed", "--flight");
}

void addInputOptions(CommandLine& line, BenchmarkOptions& options) {
  line.beginGroup("Input");
  addTumOption(line, options);
  addFolderOptions(line, options);
  line.onlyWith("--depth-scale", "--tum");
  line.onlyWith("--pose-tolerance", "--tum");
  line.addText({"--raw", "NAME", "read packed frames from NAME.raw and NAME.txt, instead of --tum"},
               options.raw_name);
  addFrameOptions(line, options);
  addFlightOptions(line, options);
  line.requireOneOf({"--tum", "--raw", "--flight"});
}

}  // namespace

BenchmarkOptions parseBenchmarkOptions(const std::vector<std::string>& arguments) {
  BenchmarkOptions options;
  CommandLine line("benchmark", "(--tum DIR | --raw NAME | --flight) [options]",
                   "Measures time and memory per frame, from its upload to the updated mesh and, "
                   "on a CPU, the time per stage. Reading and rendering frames is not timed.");
  addInputOptions(line, options);
  line.beginGroup("Settings");
  addMapperOptions(line, options);
  line.beginGroup("Output");
  addReportOptions(line, options);
  line.parse(arguments);
  if (line.given("--frames") && options.flight) {
    throw UsageError("--frames can only be used with --tum or --raw");
  }
  return options;
}

}  // namespace dtsdf
