#include "benchmark/benchmark_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "mapper/probed_mapper.h"
#include "tools/reconstruction_report.h"

namespace dtsdf {
namespace {

using nlohmann::json;

constexpr double kMiB = 1024.0 * 1024.0;

json toJson(const Summary& times) {
  return {{"median", times.median}, {"p95", times.p95}, {"worst", times.worst}};
}

template <class Item, class Value>
std::vector<double> valuesOf(const std::vector<Item>& items, size_t first, const Value& value) {
  std::vector<double> values;
  for (size_t i = first; i < items.size(); ++i) values.push_back(value(items[i]));
  return values;
}

std::string textOf(const json& report) {
  return report.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

json backendOf(const Measurement& m) {
  return {{"backend", m.backend_name.substr(0, m.backend_name.find(' '))},
          {"device", m.backend_name}};
}

size_t firstCounted(size_t frames) { return frames > 1 ? 1 : 0; }

json totalsOf(const Measurement& m) {
  const size_t first = firstCounted(m.frames.size());
  const auto summary = [&](double FrameTime::*time) {
    const auto value = [&](const FrameTime& frame) { return frame.*time; };
    return toJson(summarise(valuesOf(m.frames, first, value)));
  };
  json totals = backendOf(m);
  totals["frames"] = m.frames.size();
  totals["first_frame_ms"] = m.frames.front().total_ms;
  totals["total_ms"] = summary(&FrameTime::total_ms);
  totals["processor_ms"] = summary(&FrameTime::processor_ms);
  totals["call_ms"] = summary(&FrameTime::call_ms);
  if (!m.fusion_ms.empty()) totals["fusion_ms"] = toJson(summarise(m.fusion_ms));
  totals["fetch_ms"] = summary(&FrameTime::fetch_ms);
  totals["distances_ms"] = summary(&FrameTime::distances_ms);
  return totals;
}

json stagesOf(const Measurement& m) {
  const size_t first = firstCounted(m.stages.size());
  json stages = json::array();
  for (int s = 0; s < kStageCount; ++s) {
    const auto stage = static_cast<Stage>(s);
    const Summary times = summarise(
        valuesOf(m.stages, first, [&](const Profile& profile) { return profile.of(stage); }));
    if (times.worst > 0.0) stages.push_back({{"stage", toString(stage)}, {"ms", toJson(times)}});
  }
  return stages;
}

json memoryOf(const Measurement& m) {
  return {{"device", m.device_bytes},    {"whole_mesh", m.mesh_bytes},
          {"spare", m.memory.spare},     {"indices", m.memory.indices},
          {"mesh", m.memory.meshes},     {"scratch", m.memory.scratch},
          {"staging", m.memory.staging}, {"space", m.memory.space}};
}

json mapOf(const Measurement& m) {
  return {{"blocks", m.map.blocks},
          {"voxel_arrays", m.map.voxel_arrays},
          {"bytes", m.map.map_bytes},
          {"triangles", m.triangles}};
}

/// One row per GiB of mapped data and direction of flight (out or back). The first frame is
/// excluded because it allocates memory.
json flightByGib(const std::vector<FrameTime>& times) {
  constexpr double kGiB = 1024.0 * kMiB;
  json rows = json::array();
  for (size_t begin = 1; begin < times.size();) {
    const int gib = static_cast<int>(static_cast<double>(times[begin].mapped_bytes) / kGiB);
    size_t end = begin, map_bytes = 0, resident_bytes = 0;
    std::vector<double> total_ms, fetch_ms, distances_ms;
    for (; end < times.size() && times[end].on_return == times[begin].on_return &&
           static_cast<int>(static_cast<double>(times[end].mapped_bytes) / kGiB) == gib;
         ++end) {
      map_bytes = std::max(map_bytes, times[end].map_bytes);
      resident_bytes = std::max(resident_bytes, times[end].resident_bytes);
      total_ms.push_back(times[end].total_ms);
      fetch_ms.push_back(times[end].fetch_ms);
      distances_ms.push_back(times[end].distances_ms);
    }
    rows.push_back({{"gib", gib},
                    {"way", times[begin].on_return ? "back" : "out"},
                    {"frames", end - begin},
                    {"total_ms", toJson(summarise(total_ms))},
                    {"mean_ms", summarise(total_ms).mean},
                    {"fetch_ms", toJson(summarise(fetch_ms))},
                    {"distances_ms", toJson(summarise(distances_ms))},
                    {"map_mib", static_cast<double>(map_bytes) / kMiB},
                    {"resident_mib", static_cast<double>(resident_bytes) / kMiB}});
    begin = end;
  }
  return rows;
}

}  // namespace

std::string reportMeasurement(const Measurement& measurement) {
  json report = totalsOf(measurement);
  report["map"] = mapOf(measurement);
  report["stages"] = stagesOf(measurement);
  report["memory"] = memoryOf(measurement);
  return textOf(report);
}

std::string reportFlight(const std::vector<FrameTime>& times, const Measurement& end) {
  json report = backendOf(end);
  report["frames"] = times.size();
  report["map"] = mapOf(end);
  report["map"]["refused_blocks"] = end.map.refused_blocks;
  report["memory"] = memoryOf(end);
  report["by_gib"] = flightByGib(times);
  const PageStats& pages = end.map.pages;
  report["pages"] = {{"blocks", pages.blocks}, {"bytes", pages.bytes}, {"written", pages.written},
                     {"read", pages.read},     {"waits", pages.waits}, {"wait_ms", pages.wait_ms}};
  return textOf(report);
}

}  // namespace dtsdf
