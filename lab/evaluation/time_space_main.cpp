/// time_space: what it costs a frame to keep what is known of space.

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "dtsdf_mapping/io/recording.h"
#include "dtsdf_mapping/mapper.h"
#include "evaluation/shared_options.h"
#include "program/progress_bar.h"
#include "program/run_program.h"
#include "program/stopwatch.h"

namespace dtsdf {
namespace {

struct TimeSpaceOptions {
  std::string tum_folder;
  ParamTree settings;
  size_t passes = 1;
  double shift_m = 50.0;
  bool cpu_time = false;
};

TimeSpaceOptions readOptions(const std::vector<std::string>& arguments) {
  TimeSpaceOptions options;
  CommandLine line("time_space", "TUM_DIR [options]",
                   "Fuses a recording into two maps, frame by frame, one of them with "
                   "space/enabled, and prints times as JSON: medians over all frames, over the "
                   "first and the last tenth, and over each pass. All passes see the same, so they "
                   "show how costs grow with the map.");
  line.addText({"TUM_DIR", "", "folder with depth images and poses"}, options.tum_folder);
  addSettingOption(line, options.settings);
  line.addWhole({"--passes", "N", "number of passes over the recording, each shifted along x"},
                options.passes, {1, 1e6});
  line.addNumber({"--shift", "METRES", "distance between passes, along x"}, options.shift_m,
                 {-1e4, 1e4});
  line.addFlag("--cpu-time",
               "measure the processor time of all threads instead of wall time, for a busy machine",
               options.cpu_time);
  line.parse(arguments);
  return options;
}

/// Of one frame, in milliseconds.
struct FrameTimes {
  double integrate = 0.0, mesh = 0.0, distances = 0.0;

  double all() const { return integrate + mesh + distances; }
};

/// A map that is kept up to date frame by frame, as one that is asked after each is.
class TimedMap {
 public:
  TimedMap(const MapperParams& params, bool cpu_time)
      : mapper_(makeMapper(params)), cpu_time_(cpu_time) {}

  void add(const DepthFrame& frame) {
    FrameTimes times;
    times.integrate = timed([&] { mapper_->integrate(frame); });
    times.mesh = timed([&] { mapper_->updateMesh(); });
    if (mapper_->space() != nullptr) {
      times.distances = timed([&] { mapper_->space()->updateDistances(); });
    }
    times_.push_back(times);
  }

  const std::vector<FrameTimes>& times() const { return times_; }
  const Mapper& mapper() const { return *mapper_; }
  Space* space() { return mapper_->space(); }

 private:
  template <class Work>
  double timed(const Work& work) const {
    const Stopwatch watch;
    const double processor_start_s = processorSeconds();
    work();
    return cpu_time_ ? 1e3 * (processorSeconds() - processor_start_s) : watch.milliseconds();
  }

  std::unique_ptr<Mapper> mapper_;
  const bool cpu_time_;
  std::vector<FrameTimes> times_;
};

/// Frames [first, last).
struct FrameRange {
  size_t first, last;
};

template <class Value>
double medianOver(const FrameRange& range, const Value& value) {
  std::vector<double> values;
  for (size_t i = range.first; i < range.last; ++i) values.push_back(value(i));
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

nlohmann::json mediansOver(const FrameRange& range, const std::vector<FrameTimes>& off,
                           const std::vector<FrameTimes>& on) {
  const auto median = [&](const auto& value) { return medianOver(range, value); };
  return {{"off_ms", median([&](size_t i) { return off[i].all(); })},
          {"on_ms", median([&](size_t i) { return on[i].all(); })},
          {"share", median([&](size_t i) { return on[i].all() / off[i].all() - 1.0; })},
          {"share_without_distances",
           median([&](size_t i) { return (on[i].all() - on[i].distances) / off[i].all() - 1.0; })},
          {"see_free_ms", median([&](size_t i) { return on[i].integrate - off[i].integrate; })},
          {"surfaces_ms", median([&](size_t i) { return on[i].mesh - off[i].mesh; })},
          {"distances_ms", median([&](size_t i) { return on[i].distances; })}};
}

void timeSpace(const TimeSpaceOptions& options) {
  MapperParams params = spaceParams(options.settings);
  TimedMap on(params, options.cpu_time);
  params.space.enabled = false;
  TimedMap off(params, options.cpu_time);
  RecordingOptions tum;
  tum.path = options.tum_folder;
  tum.format = "tum";
  for (size_t pass = 0; pass < options.passes; ++pass) {
    const auto frames = openRecording(tum);
    ProgressBar progress("frames", frames->size());
    size_t done = 0;
    while (const auto frame = frames->next()) {
      DepthFrame shifted = frame->depth;
      shifted.T_W_C.pretranslate(
          Eigen::Vector3d(options.shift_m * static_cast<double>(pass), 0.0, 0.0));
      const std::array<TimedMap*, 2> order = {done % 2 == 0 ? &on : &off,
                                              done % 2 == 0 ? &off : &on};
      for (TimedMap* const map : order) map->add(shifted);
      progress.show(++done);
    }
  }
  const size_t count = on.times().size(), tenth = std::max<size_t>(1, count / 10);
  const auto medians = [&](size_t first, size_t last) {
    return mediansOver({first, last}, off.times(), on.times());
  };
  std::vector<nlohmann::json> passes;
  for (size_t pass = 0; pass < options.passes; ++pass) {
    passes.push_back(medians(pass * count / options.passes, (pass + 1) * count / options.passes));
  }
  const auto mib = [](size_t bytes) { return static_cast<double>(bytes) / 1048576.0; };
  const nlohmann::json json = {{"backend", on.mapper().backendName()},
                               {"frames", count},
                               {"cell_mm", 1e3 * on.space()->cellSize_m()},
                               {"map_mib", mib(on.mapper().stats().map_bytes)},
                               {"space_mib", mib(on.space()->bytes())},
                               {"all", medians(0, count)},
                               {"first_tenth", medians(0, std::min(tenth, count))},
                               {"last_tenth", medians(count - std::min(tenth, count), count)},
                               {"passes", passes}};
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("time_space", argc, argv, dtsdf::readOptions, dtsdf::timeSpace);
}
