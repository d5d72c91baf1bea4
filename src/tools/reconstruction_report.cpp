#include "tools/reconstruction_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

namespace dtsdf {
namespace {

nlohmann::json toJson(const Summary& times) {
  return {{"mean", times.mean}, {"median", times.median}, {"p95", times.p95}};
}

nlohmann::json toJson(const PageStats& pages) {
  return {
      {"blocks", pages.blocks},   {"bytes", pages.bytes},       {"index_bytes", pages.index_bytes},
      {"written", pages.written}, {"read", pages.read},         {"waits", pages.waits},
      {"wait_ms", pages.wait_ms}, {"failures", pages.failures}, {"lost", pages.lost},
      {"problem", pages.problem}};
}

}  // namespace

Summary summarise(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const size_t count = values.size();
  Summary summary;
  summary.mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(count);
  summary.median = 0.5 * (values[(count - 1) / 2] + values[count / 2]);
  const size_t rank = (95 * count + 99) / 100;  // rounded up, counted from 1
  summary.p95 = values[rank - 1];
  summary.worst = values.back();
  return summary;
}

std::string reportJson(const ReconstructionResult& result, const std::string& backend_name) {
  nlohmann::json report;
  report["backend"] = backend_name.substr(0, backend_name.find(' '));  // "cpu" or "cuda"
  report["device"] = backend_name;
  report["frames"] = result.frames;
  report["frames_skipped"] = nlohmann::json(result.skipped);
  if (!result.aligned.empty()) {
    report["frames_aligned"] = nlohmann::json(result.aligned);
    report["align_ms"] = toJson(summarise(result.align_ms));
    for (const LostRun& run : result.lost) {
      report["lost"].push_back({{"from_s", run.from_s},
                                {"fused_before", run.fused_before},
                                {"images", run.images},
                                {"why", run.why}});
    }
  }
  if (!result.shift_mm.empty()) {
    report["poses_moved"] = {{"mm", toJson(summarise(result.shift_mm))},
                             {"degrees", toJson(summarise(result.turn_degrees))},
                             {"points_on_surfaces_before", result.on_surfaces_before},
                             {"points_on_surfaces", result.on_surfaces}};
  }
  report["integrate_ms"] = toJson(summarise(result.integrate_ms));
  report["colour_images"] = result.images;
  report["paint_ms"] = toJson(summarise(result.paint_ms));
  report["colour_bytes"] = result.map.colour_bytes;
  report["mesh_ms"] = toJson(summarise(result.mesh_ms));
  report["mesh_updates"] = result.mesh_ms.size();
  report["blocks"] = result.map.blocks;
  report["voxel_arrays"] = result.map.voxel_arrays;
  report["map_bytes"] = result.map.map_bytes;
  report["map_bytes_peak"] = result.map.map_bytes_peak;
  report["pages"] = toJson(result.map.pages);
  report["refused_blocks"] = result.map.refused_blocks;
  report["vertices"] = result.vertices;
  report["triangles"] = result.triangles;
  // Reasons and names of devices may contain bytes that are not UTF-8.
  return report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace dtsdf
